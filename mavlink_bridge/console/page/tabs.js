/** The parts of the side, one at a time; as the patterns for tabs have it: arrows move, one tab stop. */

import { h } from "./dom.js";
import { isServed } from "./inside.js";
import { texts } from "./texts.js";

/**
 * @param {import("./store.js").Store<import("./types.js").PageState>} store
 * @param {[keyof typeof texts.tabs, HTMLElement][]} parts
 */
export function tabs(store, parts) {
  const buttons = parts.map(([name], i) => h("button", { type: "button", role: "tab", id: `tab-${name}`, "aria-controls": `part-${name}`, onclick: () => choose(i) }, texts.tabs[name]));
  const panels = parts.map(([name, body]) => h("div", { role: "tabpanel", id: `part-${name}`, "aria-labelledby": `tab-${name}`, tabindex: "0", class: "part" }, body));
  const choose = (/** @type {number} */ chosen) => {
    buttons.forEach((button, i) => {
      button.setAttribute("aria-selected", String(i === chosen));
      button.tabIndex = i === chosen ? 0 : -1;
      panels[i].hidden = i !== chosen;
    });
    const name = parts[chosen][0];
    const { tool } = store.state;
    if (tool === "polygon" || tool === "circle") {
      return; // who looks elsewhere in between goes on drawing: on the map stand the signs that end it
    }
    // A click on the map sets targets where targets are asked for, and nothing by accident elsewhere.
    store.set({ tool: isServed && name === "plan" ? (tool === "add" ? "add" : "target") : "none", ...(name === "fence" ? {} : { zone: null }) });
  };
  const list = h("div", { role: "tablist", class: "tabs", "aria-label": texts.tabsName, onkeydown: (/** @type {KeyboardEvent} */ event) => {
    const at = buttons.findIndex((button) => button === document.activeElement);
    const to = { ArrowRight: at + 1, ArrowLeft: at - 1, Home: 0, End: buttons.length - 1 }[event.key];
    if (at >= 0 && to !== undefined) {
      event.preventDefault();
      const next = (to + buttons.length) % buttons.length;
      choose(next);
      buttons[next].focus();
    }
  } }, buttons);
  choose(0);
  return h("div", { class: "tab-box" }, list, panels);
}

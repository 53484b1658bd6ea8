/** The table of legs: what is hovered here is marked on the map, and the other way round. */

import { fill, h, show } from "../dom.js";
import { texts } from "../texts.js";

/** @typedef {import("../types.js").PageState} PageState */

/** @param {import("../store.js").Store<PageState>} store */
export function legTable(store) {
  const body = h("tbody", {});
  const table = h("table", { class: "legs" }, h("caption", { class: "unseen" }, texts.plan.legsName), h("thead", {}, h("tr", {}, texts.plan.legHead.map((name) => h("th", { scope: "col" }, name)))), body);
  const section = h("section", { "aria-label": texts.plan.legs }, h("h2", {}, texts.plan.legs), h("div", { class: "scroll", tabindex: "0", role: "group", "aria-label": texts.plan.legsName }, table));
  /** @type {HTMLTableRowElement[]} */
  let rows = [];
  store.watch(["plan"], ({ plan }) => {
    rows = (plan?.legs ?? []).map((leg) => row(leg, store));
    fill(body, rows);
    show(section, rows.length > 0);
  });
  store.watch(["hoverLeg"], ({ hoverLeg }) => {
    rows.forEach((one, i) => one.classList.toggle("hovered", i === hoverLeg));
    if (hoverLeg !== null && document.activeElement && !section.contains(document.activeElement) && !section.matches(":hover")) {
      const box = section.querySelector(".scroll");
      if (box && rows[hoverLeg]) {
        box.scrollTop = rows[hoverLeg].offsetTop - box.clientHeight / 2;
      }
    }
  });
  return section;
}

/**
 * @param {import("../types.js").Leg} leg
 * @param {import("../store.js").Store<PageState>} store
 */
function row(leg, store) {
  const hover = () => store.set({ hoverLeg: leg.index });
  const leave = () => store.set({ hoverLeg: null });
  const verdict = texts.plan.verdict(leg.verdict);
  return h("tr", { class: `leg ${leg.verdict}`, onmouseenter: hover, onmouseleave: leave, title: leg.text || null },
    h("th", { scope: "row" }, h("button", { type: "button", class: "link", onfocus: hover, onblur: leave, onclick: hover, "aria-label": `${leg.name}: ${verdict}. ${leg.text}` }, leg.name)),
    h("td", {}, `${leg.length_m.toFixed(1)} m`), h("td", {}, texts.duration(leg.time_s)), h("td", {}, clear(leg.drawn_m)), h("td", {}, clear(leg.driven_m)),
    h("td", { class: "verdict" }, verdict));
}

/** @param {number | null} value */
function clear(value) {
  return value === null ? "–" : `${value.toFixed(2)} m`;
}

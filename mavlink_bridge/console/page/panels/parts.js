/** Small parts that panels are made of. */

import { fill, h, say } from "../dom.js";
import { readPlace, writePlace } from "../geo.js";
import { icon } from "../icons.js";
import { INSIDE } from "../inside.js";
import { texts } from "../texts.js";

/** @typedef {import("../geo.js").Place} Place */

const PRESS_MS = 1000; // how long "press and hold" takes; chosen: longer than a slip of the hand

/**
 * @param {string} text
 * @param {() => void} act
 * @param {Record<string, any>} [attributes]
 */
export function button(text, act, attributes = {}) {
  return h("button", { type: "button", onclick: act, ...attributes }, text);
}

/**
 * A small button of one sign, with its name for who cannot see it.
 * @param {import("../icons.js").IconName} sign
 * @param {string} name
 * @param {() => void} act
 * @param {Record<string, any>} [attributes]
 */
export function signButton(sign, name, act, attributes = {}) {
  return h("button", { type: "button", onclick: act, class: "sign", "aria-label": name, title: name, ...attributes }, icon(sign));
}

/**
 * A field for one place, typed as "latitude, longitude".
 * @param {string} name
 * @param {Place | null} place
 * @param {(place: Place) => void} onplace
 */
export function placeField(name, place, onplace) {
  const input = h("input", { type: "text", inputmode: "text", "aria-label": name, value: place ? writePlace(place) : "", placeholder: texts.coordinates, autocomplete: "off", spellcheck: "false" });
  input.addEventListener("change", () => {
    const read = readPlace(input.value);
    input.setCustomValidity(read || input.value === "" ? "" : texts.badPlace);
    if (read) {
      onplace(read);
    } else if (input.value !== "") {
      input.reportValidity();
    }
  });
  return input;
}

/**
 * A button that acts only after it was pressed for a second: by mouse, finger or key.
 * @param {string} text
 * @param {string} whilePressed
 * @param {string} name
 * @param {() => void} act
 */
export function pressButton(text, whilePressed, name, act) {
  const label = h("span", {}, text);
  const element = h("button", { type: "button", class: "press", "aria-label": name }, h("span", { class: "press-fill", "aria-hidden": "true" }), label);
  let timer = 0;
  const end = () => {
    clearTimeout(timer);
    timer = 0;
    element.classList.remove("pressed");
    say(label, text);
  };
  const begin = () => {
    if (!timer && !element.disabled) {
      element.classList.add("pressed");
      say(label, whilePressed);
      timer = setTimeout(() => {
        // Control, plan or server may be another one since it was pressed.
        const isStill = !element.disabled && element.isConnected && !document.hidden;
        end();
        if (isStill) {
          act();
        }
      }, PRESS_MS);
    }
  };
  element.addEventListener("pointerdown", (event) => {
    if (event.isPrimary && event.button === 0) {
      element.setPointerCapture(event.pointerId);
      begin();
    }
  });
  for (const stop of ["pointerup", "pointercancel", "blur", "contextmenu"]) {
    element.addEventListener(stop, end);
  }
  element.addEventListener("keydown", (event) => {
    if (event.key === "Enter" || event.key === " ") {
      event.preventDefault();
      // A key that something lies on presses once, and not again every second.
      if (!event.repeat) {
        begin();
      }
    }
  });
  element.addEventListener("keyup", end);
  return element;
}

/**
 * Notes of one level, each a line; nothing where there are none.
 * @param {string} kind a class: dangers, warnings, info
 * @param {string[]} lines
 * @param {string} title
 */
export function notes(kind, lines, title) {
  if (lines.length === 0) {
    return null;
  }
  const list = h("ul", {}, lines.map((text) => h("li", {}, text)));
  return kind === "info"
    ? h("details", { class: "notes info" }, h("summary", {}, `${title} (${lines.length})`), list)
    : h("div", { class: `notes ${kind}` }, h("strong", {}, title), list);
}

/**
 * Facts as a list of names and values, whose values change.
 * @param {[string, string][]} names key and words
 */
export function facts(names) {
  const values = new Map(names.map(([key]) => [key, h("dd", {})]));
  const element = h("dl", { class: "facts" }, names.map(([key, name]) => h("div", {}, h("dt", {}, name), /** @type {Node} */ (values.get(key)))));
  /** @param {string} key @param {string} text @param {string} [look] */
  const set = (key, text, look = "") => {
    const value = /** @type {HTMLElement} */ (values.get(key));
    say(value, text);
    if (value.className !== look) {
      value.className = look;
    }
  };
  return { element, set };
}

/**
 * Ask before something is done that cannot be undone.
 * @param {string} question
 * @param {string} yes
 * @returns {Promise<boolean>}
 */
export function confirmed(question, yes) {
  return new Promise((resolve) => {
    const dialog = h("dialog", { "aria-label": question });
    const done = (/** @type {boolean} */ answer) => { dialog.close(); dialog.remove(); resolve(answer); };
    fill(dialog, h("p", {}, question), h("div", { class: "row" }, button(yes, () => done(true), { class: "main" }), button(texts.cancel, () => done(false), { autofocus: true })));
    dialog.addEventListener("cancel", () => done(false));
    document.body.append(dialog);
    dialog.showModal();
  });
}

/**
 * What stands between a person and writing to the vehicle, in words; empty where nothing does.
 * @param {import("../types.js").PageState} state
 */
export function cannotWrite({ server, control, page, isConnected }) {
  if (!isConnected) {
    return texts.start.lost;
  }
  if (!server.can.upload) {
    return texts.start.noUpload;
  }
  return control.holder === page ? "" : texts.start.noControl;
}

/** What was found in a log, or between two files: in a page that is one file. */
export function foundPart() {
  const found = INSIDE?.notes ?? [];
  return found.length > 0 && h("section", { "aria-label": texts.foundHere }, h("h2", {}, texts.foundHere), h("ul", {}, found.map((text) => h("li", {}, text))));
}

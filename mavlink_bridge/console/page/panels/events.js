/** What was decided and what happened, newest first, in plain words. */

import { fill, h, show } from "../dom.js";
import { texts } from "../texts.js";
import { signButton } from "./parts.js";

/** @typedef {import("../types.js").PageState} PageState */

const MOST = 300; // rows shown; chosen: more is read in the log
const IMPORTANT = ["critical", "emergency", "alert", "error", "warning", "notice"];

/**
 * @param {import("../store.js").Store<PageState>} store
 * @param {(place: import("../geo.js").Place) => void} onplace
 */
export function eventsPanel(store, onplace) {
  const list = h("ol", { class: "events", "aria-label": texts.events.title, reversed: true });
  const none = h("p", { class: "quiet" }, texts.events.none);
  const important = h("input", { type: "checkbox", onchange: () => draw() });
  /** @type {import("../types.js").Event[]} */
  let events = [];
  const draw = () => {
    const shown = events.filter((event) => !important.checked || IMPORTANT.includes(event.severity)).slice(-MOST).reverse();
    fill(list, shown.map((event) => row(event, onplace)));
    show(none, shown.length === 0);
  };
  store.watch(["events"], (state) => { events = state.events; draw(); });
  return h("div", { class: "panel-body" }, h("section", { "aria-label": texts.events.title }, h("div", { class: "row spread" }, h("h2", {}, texts.events.title), h("label", {}, important, texts.events.important)), none, list));
}

/**
 * @param {import("../types.js").Event} event
 * @param {(place: import("../geo.js").Place) => void} onplace
 */
function row(event, onplace) {
  const { position } = event;
  const severity = texts.events.severities[event.severity] ?? event.severity;
  return h("li", { class: `event ${event.severity}` }, h("span", { class: "event-sign", title: severity, role: "img", "aria-label": severity }, texts.events.signs[event.severity] ?? "·"),
    h("time", {}, texts.clock(event.time_s)), h("span", { class: "grow" }, event.text), position && signButton("place", texts.events.show, () => onplace(position)));
}

/** What was driven against what was promised, after a drive. */

import { get } from "../connection.js";
import { fill, h, show } from "../dom.js";
import { texts } from "../texts.js";
import { button } from "./parts.js";

/** @typedef {import("../types.js").PageState} PageState */


/** @param {import("../store.js").Store<PageState>} store */
export function comparison(store) {
  const body = h("div", {});
  const section = h("section", { "aria-label": texts.after.title }, h("h2", {}, texts.after.title), body, button(texts.after.refresh, () => ask(store)));
  let before = "";
  store.watch(["drive"], ({ drive }) => {
    // At the end of a drive, and of each piece of it; and where a page is opened after one.
    const ended = drive.begun_s === null || drive.is_driving ? "" : `${drive.begun_s} ${drive.state === "arrived"}`;
    if (ended !== "" && ended !== before) {
      ask(store);
    }
    before = ended;
  });
  store.watch(["after", "drive"], ({ after, drive }) => show(section, after !== null || drive.begun_s !== null));
  store.watch(["after"], ({ after }) => fill(body, after ? table(after) : null));
  return section;
}

/** @param {import("../store.js").Store<PageState>} store */
async function ask(store) {
  try {
    store.set({ after: await get("/api/after") });
  } catch {
    store.set({ after: null });
  }
}

/**
 * The whole drive, and each of its pieces where there are several.
 * @param {any} after
 */
function table(after) {
  const names = texts.after;
  const { pieces, is_kept: isKept } = after;
  const rows = [[names.promised, promised(after)], [names.least, texts.m(after.least_m)], [names.driven, texts.m(after.driven_m, 1)],
    [names.time, `${texts.duration(after.took_s)} (${names.predicted} ${texts.duration(after.predicted_s)})`], [names.deviation, `${after.deviation_max_m.toFixed(2)} m`]];
  return [h("p", { class: isKept ? "card good" : "card bad" }, isKept ? (after.has_arrived ? names.kept : names.keptSoFar) : names.broken),
    h("dl", { class: "facts" }, rows.map(([name, value]) => h("div", {}, h("dt", {}, name), h("dd", {}, value)))),
    pieces.length > 1 && h("div", { class: "scroll", tabindex: "0", role: "group", "aria-label": names.pieces }, h("table", { class: "pieces" }, h("caption", {}, names.pieces),
      h("thead", {}, h("tr", {}, names.pieceHead.map((name) => h("th", { scope: "col" }, name)))),
      h("tbody", {}, pieces.map((/** @type {any} */ one, /** @type {number} */ i) => h("tr", { class: one.is_kept ? "" : "breaks" }, h("th", { scope: "row" }, String(i + 1)), [texts.m(one.driven_m, 1), promised(one), texts.m(one.least_m)].map((text) => h("td", {}, text)),
        h("td", { class: "verdict" }, names.piece(one.is_kept, one.has_arrived)))))))];
}

/** @param {{promised_m: number | null}} one */
function promised({ promised_m }) {
  return promised_m === null ? "–" : texts.m(promised_m);
}

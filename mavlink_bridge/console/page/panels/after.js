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
    if (drive.state === "arrived" && before !== "arrived" && drive.begun_s !== null) {
      ask(store);
    }
    before = drive.state;
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

/** @param {any} after */
function table(after) {
  const names = texts.after;
  const isKept = after.breaches === 0 && (after.promised_m === null || after.least_m === null || after.least_m >= after.promised_m);
  const rows = [[names.promised, after.promised_m === null ? "–" : texts.m(after.promised_m)], [names.least, texts.m(after.least_m)],
    [names.time, `${texts.duration(after.took_s)} (${names.predicted} ${texts.duration(after.predicted_s)})`], [names.deviation, `${after.deviation_max_m.toFixed(2)} m`]];
  return [h("p", { class: isKept ? "card good" : "card bad" }, isKept ? names.kept : names.broken),
    h("dl", { class: "facts" }, rows.map(([name, value]) => h("div", {}, h("dt", {}, name), h("dd", {}, value))))];
}

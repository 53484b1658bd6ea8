/** Files in and out, and the backups of what was on the vehicle. */

import { get } from "../connection.js";
import { fill, h, keepFocus, show } from "../dom.js";
import { refusal } from "../planner.js";
import { texts } from "../texts.js";
import { button, cannotWrite, confirmed, notes } from "./parts.js";

/** @typedef {import("../types.js").PageState} PageState */
/** @typedef {import("../actions.js").Actions} Actions */
/** @typedef {import("../store.js").Store<PageState>} PageStore */

/**
 * @param {PageStore} store
 * @param {Actions} act
 */
export function filesPanel(store, act) {
  return h("div", { class: "panel-body" }, openPart(store, act), savePart(store, act), backupsPart(store, act));
}

/**
 * @param {PageStore} store
 * @param {Actions} act
 */
function openPart(store, act) {
  const input = h("input", { type: "file", "aria-label": texts.files.open, onchange: () => {
    const file = input.files?.[0];
    if (file) {
      act.open(file);
      input.value = "";
    }
  } });
  const formats = h("p", { class: "quiet" });
  const remarks = h("div", {});
  store.watch(["server"], ({ server }) => {
    fill(formats, texts.files.formats(server.reads));
    input.accept = server.reads.join(",");
  });
  store.watch(["opened"], ({ opened }) => fill(remarks, opened ? notes("warnings", opened.remarks, `${texts.files.remarks} ${opened.name}`) : null));
  return h("section", { "aria-label": texts.files.open }, h("h2", {}, texts.files.open), h("p", {}, texts.files.drop), input, formats, remarks);
}

/**
 * @param {PageStore} store
 * @param {Actions} act
 */
function savePart(store, act) {
  const what = h("select", { "aria-label": texts.files.what }, Object.entries(texts.files.whats).map(([value, name]) => h("option", { value }, name)));
  const format = h("select", { "aria-label": texts.files.format });
  const save = button(texts.files.download, () => act.save(what.value, format.value));
  store.watch(["server"], ({ server }) => fill(format, server.writes.map((suffix) => h("option", { value: suffix }, suffix))));
  store.watch(["plan", "mission", "fence", "doc"], ({ plan, mission, fence, doc }) => {
    const has = { plan: Boolean(plan && !plan.no_route && plan.points.length > 0), mission: Boolean(mission && mission.items > 0), fence: doc.zones !== null || fence.held.features.length > 0 };
    for (const option of what.options) {
      option.disabled = !has[/** @type {keyof typeof has} */ (option.value)];
    }
    const enabled = [...what.options].find((option) => !option.disabled);
    if (what.selectedOptions[0]?.disabled && enabled) {
      what.value = enabled.value;
    }
    save.disabled = !enabled;
  });
  return h("section", { "aria-label": texts.files.save }, h("h2", {}, texts.files.save), h("div", { class: "row" }, what, format, save));
}

/**
 * @param {PageStore} store
 * @param {Actions} act
 */
function backupsPart(store, act) {
  const list = h("ul", { class: "plain" });
  const restore = async (/** @type {string} */ name) => {
    if (await confirmed(texts.files.restoreAsk(name), texts.files.restore)) {
      await act.restore(name);
    }
  };
  const load = async () => {
    try {
      const backups = await get("/api/backups");
      const reason = cannotWrite(store.state);
      keepFocus(list, () => fill(list, backups.map((/** @type {any} */ one) => h("li", {}, h("span", { class: "grow" }, one.name, h("br"), h("small", {}, `${one.what}, ${one.items} · ${new Date(one.time_s * 1000).toLocaleString("en-GB")} · ${one.vehicle}`)),
        button(texts.files.restore, () => restore(one.name), { disabled: reason !== "" || !one.is_this_vehicle, title: reason || null, "aria-label": `${texts.files.restore} ${one.name}` })))));
      if (backups.length === 0) {
        fill(list, h("li", { class: "quiet" }, texts.files.noBackups));
      }
    } catch (error) {
      fill(list, h("li", { class: "quiet" }, refusal(error).message));
    }
  };
  const section = h("section", { "aria-label": texts.files.backups }, h("h2", {}, texts.files.backups), list, button(texts.files.load, load));
  store.watch(["server", "upload", "control", "isConnected"], ({ server, upload, isConnected }) => {
    const isLive = server.source === "live" || server.source === "demo";
    show(section, isLive);
    if (isLive && isConnected && upload?.state !== "running") {
      load();
    }
  });
  return section;
}

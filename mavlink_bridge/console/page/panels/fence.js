/** The fence: as the autopilot holds and means it, and as it is drawn here. */

import { fill, h, keepFocus, say, show } from "../dom.js";
import { readPlace } from "../geo.js";
import { isServed } from "../inside.js";
import { texts } from "../texts.js";
import { button, cannotWrite, notes, placeField, signButton } from "./parts.js";

/** @typedef {import("../types.js").PageState} PageState */
/** @typedef {import("../types.js").Zone} Zone */
/** @typedef {import("../actions.js").Actions} Actions */
/** @typedef {import("../store.js").Store<PageState>} PageStore */

/**
 * @param {PageStore} store
 * @param {Actions} act
 */
export function fencePanel(store, act) {
  return h("div", { class: "panel-body" }, shownPart(store, act), isServed && [drawPart(store), zonesPart(store, act), typePart(act)]);
}

/**
 * @param {PageStore} store
 * @param {Actions} act
 */
function shownPart(store, act) {
  const text = h("div", {});
  const edit = button(texts.fence.edit, () => act.takeFence());
  const back = button(texts.fence.back, () => act.heldFence());
  const upload = button(texts.fence.upload, () => act.uploadFence(), { class: "main" });
  const why = h("p", { class: "quiet" });
  store.watch(["fence", "looked", "doc", "server", "control", "page", "isConnected"], (state) => {
    const { fence, looked, doc, server } = state;
    const isDrawn = doc.zones !== null;
    fill(text, described(isDrawn ? looked : fence, isDrawn));
    show(edit, !isDrawn);
    show(back, isDrawn);
    const isLive = server.source === "live" || server.source === "demo";
    show(upload, isDrawn && isLive);
    const reason = cannotWrite(state);
    upload.disabled = reason !== "" || (looked !== null && looked.trouble !== "");
    say(why, isDrawn && isLive ? reason : "");
  });
  return h("section", { "aria-label": texts.fence.title }, h("h2", {}, texts.fence.title), text, isServed && [h("div", { class: "row" }, edit, back, upload), why]);
}

/**
 * @param {import("../types.js").Fence | null} fence
 * @param {boolean} isDrawn
 */
function described(fence, isDrawn) {
  const words = texts.fence;
  if (!fence || (fence.held.features.length === 0 && !fence.trouble)) {
    return [h("p", {}, isDrawn ? words.drawn : words.none)];
  }
  const { meant, enabled } = fence;
  const state = isDrawn ? words.drawn : enabled === null ? words.enabledUnknown : enabled ? words.enabled : words.disabled;
  return [
    fence.trouble && h("p", { class: "card bad" }, fence.trouble),
    h("p", { class: !isDrawn && enabled === false ? "card unsure" : "" }, state), fence.source && h("p", { class: "quiet" }, words.source(fence.source)),
    meant && h("p", {}, meant.is_bounded ? (meant.union ? words.union : words.intersection) : words.unbounded, " ", words.margin(meant.margin_m)),
    meant?.home_circle && h("p", {}, words.homeCircle(meant.home_circle.radius_m)),
    notes("warnings", fence.warnings, texts.plan.notes.warnings),
    fence.obstacles.length > 0 && h("div", {}, h("h3", {}, words.obstacles), h("ul", {}, fence.obstacles.map((one) => h("li", {}, one.name)))),
    !isDrawn && h("ul", { class: "zones" }, fence.held.features.map(({ properties }) => h("li", { class: properties.kind }, words.zoneName(properties)))),
  ];
}

/** @param {PageStore} store */
function drawPart(store) {
  const kind = h("select", { "aria-label": texts.fence.kind, onchange: () => store.set({ newKind: /** @type {any} */ (kind.value) }) },
    h("option", { value: "exclusion" }, texts.fence.exclusion), h("option", { value: "inclusion" }, texts.fence.inclusion));
  const toggle = (/** @type {"polygon" | "circle"} */ tool) => () => store.set({ tool: store.state.tool === tool ? "none" : tool, zone: null });
  const polygon = button(texts.fence.polygon, toggle("polygon"));
  const circle = button(texts.fence.circle, toggle("circle"));
  const hint = h("p", { class: "quiet", role: "status" });
  store.watch(["tool", "newKind"], ({ tool, newKind }) => {
    kind.value = newKind;
    polygon.setAttribute("aria-pressed", String(tool === "polygon"));
    circle.setAttribute("aria-pressed", String(tool === "circle"));
    say(hint, tool === "polygon" || tool === "circle" ? texts.tools.drawing[tool] : "");
  });
  return h("section", { "aria-label": texts.fence.polygon }, h("div", { class: "row" }, h("label", {}, texts.fence.kind, " ", kind), polygon, circle), hint);
}

/**
 * @param {PageStore} store
 * @param {Actions} act
 */
function zonesPart(store, act) {
  const list = h("ol", { class: "plain" });
  const section = h("section", { "aria-label": texts.fence.zones }, h("h2", {}, texts.fence.zones), list);
  store.watch(["doc", "zone"], ({ doc, zone }) => {
    const zones = doc.zones ?? [];
    show(section, zones.length > 0);
    keepFocus(list, () => fill(list, zones.map((one, i) => h("li", {}, zoneRow(one, i, i === zone, store, act), i === zone && corners(one, i, act)))));
  });
  return section;
}

/**
 * @param {Zone} zone
 * @param {number} i
 * @param {boolean} isOpen
 * @param {PageStore} store
 * @param {Actions} act
 */
function zoneRow(zone, i, isOpen, store, act) {
  const name = texts.fence.zone(i + 1, zone);
  /** @type {Zone} */
  const turned = { ...zone, kind: zone.kind === "exclusion" ? "inclusion" : "exclusion" };
  return h("div", { class: "row" }, h("span", { class: `grow ${zone.kind}` }, name),
    button(texts.fence.editZone, () => store.set({ zone: isOpen ? null : i }), { "aria-expanded": String(isOpen), "aria-label": `${texts.fence.editZone}: ${name}` }),
    signButton("turn", `${texts.fence.turn}: ${name}`, () => act.changeZone(i, turned, texts.steps.zoneKind)), signButton("no", `${texts.fence.remove}: ${name}`, () => act.removeZone(i)));
}

/**
 * @param {Zone} zone
 * @param {number} index
 * @param {Actions} act
 */
function corners(zone, index, act) {
  if (zone.shape === "circle") {
    const radius = h("input", { type: "number", min: "0.1", step: "0.1", class: "short", value: String(zone.radius_m), "aria-label": texts.fence.radius, onchange: () => act.setRadius(index, Number(radius.value)) });
    return h("div", { class: "row" }, placeField(texts.fence.centre, zone.centre, (place) => act.moveCorner(index, 0, place)), h("label", {}, radius, " m"));
  }
  const { ring } = zone;
  return h("ol", { class: "places" }, ring.map((place, i) => h("li", {}, placeField(texts.fence.corner(i + 1), place, (typed) => act.moveCorner(index, i, typed)),
    signButton("plus", texts.map.between(i + 1), () => act.addCorner(index, i + 1, middle(place, ring[(i + 1) % ring.length]))),
    signButton("no", texts.fence.removeCorner(i + 1), () => act.removeCorner(index, i), { disabled: ring.length <= 3 }))));
}

/**
 * @param {import("../geo.js").Place} a
 * @param {import("../geo.js").Place} b
 * @returns {import("../geo.js").Place}
 */
export function middle(a, b) {
  return [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2];
}

/** @param {Actions} act */
function typePart(act) {
  const lines = h("textarea", { rows: "4", "aria-label": texts.fence.typeHint, spellcheck: "false", placeholder: `${texts.coordinates}\n…` });
  const radius = h("input", { type: "number", min: "0", step: "0.1", class: "short", "aria-label": texts.fence.typeRadius });
  const kind = h("select", { "aria-label": texts.fence.kind }, h("option", { value: "exclusion" }, texts.fence.exclusion), h("option", { value: "inclusion" }, texts.fence.inclusion));
  const add = () => {
    const ring = lines.value.split("\n").filter((text) => text.trim() !== "").map(readPlace);
    const radius_m = Number(radius.value);
    const typed = zoneOf(ring, radius_m, /** @type {any} */ (kind.value));
    lines.setCustomValidity(typed ? "" : ring.includes(null) ? texts.badPlace : texts.fence.typeBad);
    if (typed) {
      act.addZone(typed);
      lines.value = radius.value = "";
    } else {
      lines.reportValidity();
    }
  };
  return h("details", {}, h("summary", {}, texts.fence.type), h("p", { class: "quiet" }, texts.fence.typeHint), lines,
    h("div", { class: "row" }, kind, h("label", {}, radius, " m"), button(texts.fence.typeAdd, add)));
}

/**
 * @param {(import("../geo.js").Place | null)[]} ring
 * @param {number} radius_m
 * @param {"inclusion" | "exclusion"} kind
 * @returns {Zone | null}
 */
function zoneOf(ring, radius_m, kind) {
  const read = ring.filter((place) => place !== null);
  if (read.length < ring.length) {
    return null;
  }
  if (read.length === 1 && radius_m > 0) {
    return { kind, shape: "circle", centre: read[0], radius_m };
  }
  return read.length >= 3 ? { kind, shape: "polygon", ring: read } : null;
}

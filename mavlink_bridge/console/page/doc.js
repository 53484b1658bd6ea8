/** What a person draws and asks for: every step makes another document, and none changes an old one. */

import { circle } from "./geo.js";

/** @typedef {import("./geo.js").Place} Place */
/** @typedef {import("./types.js").Doc} Doc */
/** @typedef {import("./types.js").Zone} Zone */

/** @type {Doc} */
export const EMPTY = { start: null, targets: [], clearance_m: null, widest: false, order: "given", comes_back: false, zones: null, mission: null };

/**
 * @template T
 * @param {readonly T[]} list
 * @param {number} index
 * @param {T} value
 */
export function replaced(list, index, value) {
  return list.map((old, i) => (i === index ? value : old));
}

/**
 * @template T
 * @param {readonly T[]} list
 * @param {number} index
 */
export function without(list, index) {
  return list.filter((_, i) => i !== index);
}

/**
 * @template T
 * @param {readonly T[]} list
 * @param {number} index
 * @param {T} value
 */
export function inserted(list, index, value) {
  return [...list.slice(0, index), value, ...list.slice(index)];
}

/**
 * @template T
 * @param {readonly T[]} list
 * @param {number} from
 * @param {number} to
 */
export function swapped(list, from, to) {
  if (to < 0 || to >= list.length) {
    return [...list];
  }
  const next = [...list];
  [next[from], next[to]] = [next[to], next[from]];
  return next;
}

/**
 * A zone as the server wants it.
 * @param {Zone} zone
 */
function zoneFeature(zone) {
  return zone.shape === "circle"
    ? { type: "Feature", properties: { kind: zone.kind, shape: "circle", centre: zone.centre, radius_m: zone.radius_m } }
    : { type: "Feature", properties: { kind: zone.kind, shape: "polygon" }, geometry: { type: "Polygon", coordinates: [[...zone.ring, zone.ring[0]]] } };
}

/** @param {Zone[] | null} zones */
export function fenceBody(zones) {
  return zones === null ? {} : { fence: { type: "FeatureCollection", features: zones.map(zoneFeature) } };
}

/**
 * The zones of a held fence, to be edited.
 * @param {import("./types.js").Fence} fence
 * @returns {Zone[]}
 */
export function zonesOf(fence) {
  return fence.held.features.map(({ geometry, properties }) => (properties.shape === "circle" && properties.centre && properties.radius_m !== null
    ? { kind: properties.kind, shape: "circle", centre: properties.centre, radius_m: properties.radius_m }
    : { kind: properties.kind, shape: "polygon", ring: geometry.coordinates[0].slice(0, -1) }));
}

/**
 * The outline of a zone, closed.
 * @param {Zone} zone
 * @returns {Place[]}
 */
export function ringOf(zone) {
  return zone.shape === "circle" ? circle(zone.centre, zone.radius_m) : [...zone.ring, zone.ring[0]];
}

/**
 * What the server is asked for: a plan, or a check of a mission; null where nothing is asked.
 * @param {Doc} doc
 * @returns {{path: string, body: any} | null}
 */
export function question(doc) {
  const shared = { ...fenceBody(doc.zones), ...startBody(doc), ...(doc.clearance_m === null ? {} : { clearance_m: doc.clearance_m }) };
  if (doc.mission) {
    return { path: "/api/check", body: { ...missionBody(doc.mission), ...shared } };
  }
  if (doc.targets.length === 0) {
    return null;
  }
  const asked = { targets: doc.targets, order: doc.order, comes_back: doc.comes_back };
  return { path: "/api/plan", body: doc.widest ? { ...asked, ...fenceBody(doc.zones), ...startBody(doc), widest: true } : { ...asked, ...shared } };
}

/** @param {Doc} doc */
export function startBody({ start }) {
  return start ? { start } : {};
}

/** @param {import("./types.js").DrawnMission} mission */
export function missionBody(mission) {
  return mission.items ? { items: mission.items } : { points: mission.points };
}

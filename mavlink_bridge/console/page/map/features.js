/** What is known, as features for the map's sources: pure functions. */

import { circle, metres, outline } from "../geo.js";
import { texts } from "../texts.js";

/** @typedef {import("../geo.js").Place} Place */
/** @typedef {import("../types.js").Plan} Plan */

/**
 * @param {any} geometry
 * @param {Record<string, any>} [properties]
 * @param {number} [id]
 */
export function feature(geometry, properties = {}, id = undefined) {
  return { type: "Feature", geometry, properties, ...(id === undefined ? {} : { id }) };
}

/**
 * @param {Place} at
 * @param {Record<string, any>} [properties]
 */
export function spot(at, properties = {}) {
  return feature({ type: "Point", coordinates: at }, properties);
}

/** @param {Place[]} coordinates
 * @param {Record<string, any>} [properties]
 * @param {number} [id]
 */
export function line(coordinates, properties = {}, id = undefined) {
  return feature({ type: "LineString", coordinates }, properties, id);
}

/** @param {import("../types.js").Fence} fence */
export function meant(fence) {
  const shown = fence.meant;
  if (!shown) {
    return [];
  }
  return [
    ...(shown.is_bounded ? [feature(shown.free, { what: "free" }), feature(shown.margin, { what: "margin" })] : []),
    ...(shown.home_circle ? [feature(shown.home_circle.geometry, { what: "home circle" })] : []),
  ];
}

/**
 * @param {import("../types.js").Fence} fence
 * @param {{pixel_m: number, scale: number}} look how many metres a pixel is, and how large letters are against the usual
 */
export function zones(fence, look) {
  return fence.held.features.map(({ geometry, properties }) => {
    const name = texts.fence.zoneLabel(properties);
    return feature(geometry, { ...properties, name: properties.kind === "inclusion" || hasRoom(geometry.coordinates[0], name, look) ? name : "" });
  });
}

// Of a name on the map: 12 px letters are so wide, lines so high and so long at the most, and it may cover so much of its shape. Chosen by looking at it.
const NAME = { letter_px: 6.6, line_px: 14.4, letters: 14, share: 0.75 };

/**
 * Whether a name leaves enough of its shape to be seen: on a small screen all of it would lie under the letters.
 * @param {Place[]} ring
 * @param {string} name
 * @param {{pixel_m: number, scale: number}} look
 */
function hasRoom(ring, name, { pixel_m, scale }) {
  const rows = name.split(" ").reduce((/** @type {string[]} */ found, word) => {
    const last = found.at(-1);
    return last !== undefined && last.length + word.length < NAME.letters ? [...found.slice(0, -1), `${last} ${word}`] : [...found, word];
  }, []);
  const wide_m = Math.max(...rows.map((row) => row.length)) * NAME.letter_px * scale * pixel_m;
  const high_m = rows.length * NAME.line_px * scale * pixel_m;
  const corners = ring.map((place) => metres(place, ring[0]));
  const [east_m, north_m] = [0, 1].map((i) => Math.max(...corners.map((corner) => corner[i])) - Math.min(...corners.map((corner) => corner[i])));
  const twice_m2 = corners.reduce((sum, [x, y], i) => sum + x * corners[(i + 1) % corners.length][1] - corners[(i + 1) % corners.length][0] * y, 0);
  return wide_m <= east_m && high_m <= north_m && wide_m * high_m <= (NAME.share * Math.abs(twice_m2)) / 2;
}

/** @param {import("../types.js").Fence} fence */
export function obstacles(fence) {
  return fence.obstacles.map((one) => feature({ type: "Polygon", coordinates: [circle(one.position, one.radius_m)] }, { name: one.name }));
}

/** @param {Plan | null} plan */
export function legs(plan) {
  return (plan?.legs ?? []).map((leg) => line([leg.start, leg.end], { verdict: leg.verdict, index: leg.index }, leg.index));
}

/** @param {Plan | null} plan */
export function corridor(plan) {
  return plan?.corridor ? [feature(plan.corridor)] : [];
}

/** @param {Plan | null} plan */
export function narrowest(plan) {
  const narrow = plan?.narrowest;
  if (!narrow) {
    return [];
  }
  const [a, b] = narrow.ends;
  return [line(narrow.ends), spot([(a[0] + b[0]) / 2, (a[1] + b[1]) / 2], { name: texts.m(narrow.width_m) })];
}

/** @param {Plan | null} plan */
export function widest(plan) {
  const path = plan?.no_route?.widest?.path;
  return path ? [feature(path)] : [];
}

/** @param {Plan | null} plan */
export function blockers(plan) {
  return (plan?.no_route?.blockers ?? []).filter((one) => one.geometry).map((one) => feature(one.geometry, { name: one.name }));
}

/** @param {Plan | null} plan */
export function points(plan) {
  const seen = new Set();
  return (plan?.points ?? []).flatMap((point, order) => {
    const isNew = point.seq > 0 && !seen.has(point.seq);
    seen.add(point.seq);
    return isNew ? [spot(point.at, { name: String(point.seq), order: 10 + order })] : [];
  });
}

/**
 * Home, rally points, targets, and places that a plan or a drive points at.
 * @param {import("../types.js").PageState} state
 */
export function marks(state) {
  const { doc, home, rally, plan, drive } = state;
  const found = [];
  if (home) {
    found.push(spot(home, { icon: "home", name: texts.map.home }));
  }
  found.push(...rally.map((at, i) => spot(at, { icon: "rally", name: texts.map.rally(i + 1) })));
  const targets = doc.targets.length > 0 || doc.mission ? doc.targets : plan?.targets ?? [];
  const many = targets.length > 1;
  found.push(...targets.map((at, i) => spot(at, { icon: "target", name: many ? texts.map.targetOf(i + 1) : texts.map.target })));
  const start = plan?.start ?? doc.start;
  if (start) {
    found.push(spot(start, { icon: "start", name: state.vehicle.position ? "" : texts.map.start }));
  }
  found.push(...troubles(plan), ...state.marks.filter((mark) => mark.icon !== "target" || !targets.some((at) => isSame(at, mark.at))).map(({ at, icon, name }) => spot(at, { icon, name })));
  if (drive.least_at && drive.least_clearance_m !== null) {
    found.push(spot(drive.least_at, { icon: "least", name: texts.drive.leastHere(drive.least_clearance_m) }));
  }
  return found;
}

/**
 * @param {Place} a
 * @param {Place} b
 */
function isSame(a, b) {
  return Math.abs(a[0] - b[0]) + Math.abs(a[1] - b[1]) < 2e-7;
}

/** @param {import("../types.js").NamedLine[]} named */
export function lines(named) {
  return named.map((one) => line(one.places, { name: one.name }));
}

/** @param {Plan | null} plan */
function troubles(plan) {
  const why = plan?.no_route;
  const at = why?.at ?? why?.widest?.at;
  const broken = (plan?.legs ?? []).filter((leg) => leg.verdict === "breaks" && leg.at);
  return [...(at ? [spot(at, { icon: "blocked", name: texts.noRoute.here })] : []),
    ...broken.map((leg) => spot(/** @type {Place} */ (leg.at), { icon: "blocked", name: texts.plan.legBreaks(leg) }))];
}

/** @param {import("../types.js").PageState} state */
export function rover(state) {
  const { position, heading_deg, footprint } = state.vehicle;
  if (!position) {
    return [];
  }
  const look = state.link.state === "lost" ? "lost" : "here";
  const found = [spot(position, { heading: heading_deg ?? 0, look })];
  if (footprint && footprint.length_m > 0 && heading_deg !== null) {
    const sides = {
      front_m: footprint.length_m / 2 - footprint.gps_forward_m, back_m: footprint.length_m / 2 + footprint.gps_forward_m,
      left_m: footprint.width_m / 2 + footprint.gps_right_m, right_m: footprint.width_m / 2 - footprint.gps_right_m,
    };
    found.unshift(feature({ type: "Polygon", coordinates: [outline(position, heading_deg, sides)] }));
  }
  return found;
}

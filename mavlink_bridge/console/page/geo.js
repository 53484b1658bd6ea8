/** Places on Earth near each other. Only for drawing and for pointing: what is promised is measured by the server. */

/** @typedef {[number, number]} Place longitude and latitude, degrees */

const RADIUS_M = 6_378_137;
const RAD = Math.PI / 180;
const CIRCLE_CORNERS = 72;

/**
 * Metres east and north of an origin.
 * @param {Place} place
 * @param {Place} origin
 * @returns {[number, number]}
 */
export function metres(place, origin) {
  const east_m = (place[0] - origin[0]) * RAD * RADIUS_M * Math.cos(origin[1] * RAD);
  return [east_m, (place[1] - origin[1]) * RAD * RADIUS_M];
}

/**
 * The place so many metres east and north of an origin, rounded to 1e-7°, as autopilots do.
 * @param {Place} origin
 * @param {number} east_m
 * @param {number} north_m
 * @returns {Place}
 */
export function moved(origin, east_m, north_m) {
  return rounded([
    origin[0] + east_m / (RAD * RADIUS_M * Math.cos(origin[1] * RAD)),
    origin[1] + north_m / (RAD * RADIUS_M),
  ]);
}

/**
 * @param {Place} place
 * @returns {Place}
 */
export function rounded(place) {
  return [Math.round(place[0] * 1e7) / 1e7, Math.round(place[1] * 1e7) / 1e7];
}

/**
 * @param {Place} a
 * @param {Place} b
 */
export function distance_m(a, b) {
  return Math.hypot(...metres(b, a));
}

/**
 * The ring of a circle.
 * @param {Place} centre
 * @param {number} radius_m
 * @returns {Place[]}
 */
export function circle(centre, radius_m) {
  return Array.from({ length: CIRCLE_CORNERS + 1 }, (_, i) => {
    const angle = (2 * Math.PI * i) / CIRCLE_CORNERS;
    return turned(centre, radius_m * Math.sin(angle), radius_m * Math.cos(angle));
  });
}

/**
 * The ring of a rover's outline.
 * @param {Place} place
 * @param {number} heading_deg
 * @param {{front_m: number, back_m: number, left_m: number, right_m: number}} sides from where its position is known
 * @returns {Place[]}
 */
export function outline(place, heading_deg, sides) {
  const { front_m, back_m, left_m, right_m } = sides;
  const corners = [[front_m, right_m], [-back_m, right_m], [-back_m, -left_m], [front_m, -left_m], [front_m, right_m]];
  const [sin, cos] = [Math.sin(heading_deg * RAD), Math.cos(heading_deg * RAD)];
  return corners.map(([ahead, right]) => turned(place, ahead * sin + right * cos, ahead * cos - right * sin));
}

/**
 * The smallest box around places, [west, south, east, north]; null without any.
 * @param {Iterable<Place>} found_places
 * @returns {[number, number, number, number] | null}
 */
export function box(found_places) {
  /** @type {[number, number, number, number]} */
  const found = [Infinity, Infinity, -Infinity, -Infinity];
  for (const [lon, lat] of found_places) {
    found[0] = Math.min(found[0], lon);
    found[1] = Math.min(found[1], lat);
    found[2] = Math.max(found[2], lon);
    found[3] = Math.max(found[3], lat);
  }
  return Number.isFinite(found[0]) ? found : null;
}

/**
 * Every place in GeoJSON coordinates, however deep they are nested.
 * @param {any} coordinates
 * @returns {Generator<Place>}
 */
export function* places(coordinates) {
  if (typeof coordinates?.[0] === "number") {
    yield coordinates;
  } else {
    for (const part of coordinates ?? []) {
      yield* places(part);
    }
  }
}

/**
 * Read "lat, lon" as people type it; null where it is none.
 * @param {string} text
 * @returns {Place | null}
 */
export function readPlace(text) {
  const numbers = text.match(/[-+]?\d+(?:\.\d+)?/g)?.map(Number) ?? [];
  const [lat, lon] = numbers;
  return numbers.length === 2 && Math.abs(lat) <= 90 && Math.abs(lon) <= 180 ? [lon, lat] : null;
}

/**
 * @param {Place} place
 */
export function writePlace(place) {
  return `${place[1].toFixed(7)}, ${place[0].toFixed(7)}`;
}

/**
 * @param {Place} origin
 * @param {number} east_m
 * @param {number} north_m
 * @returns {Place}
 */
function turned(origin, east_m, north_m) {
  return [
    origin[0] + east_m / (RAD * RADIUS_M * Math.cos(origin[1] * RAD)),
    origin[1] + north_m / (RAD * RADIUS_M),
  ];
}

/** A metric grid under everything, where there is no map: lines at round distances from home (or the field's middle). */

import { metres, moved } from "../geo.js";

/** @typedef {import("../geo.js").Place} Place */

const APART_PX = 70; // lines are at least so far from each other on the screen; chosen
const STEPS = [1, 2, 5, 10];
const MOST = 80; // lines each way

/**
 * The distance between lines, a round number of metres.
 * @param {number} pixel_m
 */
export function step_m(pixel_m) {
  const least = Math.max(pixel_m * APART_PX, 0.1);
  const power = 10 ** Math.floor(Math.log10(least));
  return power * /** @type {number} */ (STEPS.find((step) => step * power >= least * 0.999));
}

/**
 * @param {Place} origin
 * @param {{west: number, south: number, east: number, north: number}} view degrees
 * @param {number} pixel_m
 * @returns {any} GeoJSON lines; every fifth is a main one
 */
export function gridLines(origin, view, pixel_m) {
  const step = step_m(pixel_m);
  const [west_m, south_m] = metres([view.west, view.south], origin);
  const [east_m, north_m] = metres([view.east, view.north], origin);
  const features = [];
  if ((east_m - west_m) / step < MOST && (north_m - south_m) / step < MOST) {
    for (let i = Math.floor(west_m / step); i * step <= east_m; i += 1) {
      features.push(line([at(origin, i * step, south_m), at(origin, i * step, north_m)], i));
    }
    for (let i = Math.floor(south_m / step); i * step <= north_m; i += 1) {
      features.push(line([at(origin, west_m, i * step), at(origin, east_m, i * step)], i));
    }
  }
  return { type: "FeatureCollection", features };
}

/**
 * @param {Place} origin
 * @param {number} east_m
 * @param {number} north_m
 */
function at(origin, east_m, north_m) {
  return moved(origin, east_m, north_m);
}

/**
 * @param {Place[]} coordinates
 * @param {number} i
 */
function line(coordinates, i) {
  return { type: "Feature", properties: { main: i % 5 === 0 }, geometry: { type: "LineString", coordinates } };
}

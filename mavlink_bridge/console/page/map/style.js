/** How the map looks: one table of colours for light and one for dark, and the layers from the ground up. */

import { letterScale } from "../dom.js";

/** @typedef {import("../vendor/maplibre-gl/maplibre-gl.mjs").LayerSpecification} Layer */
/** @typedef {import("../vendor/maplibre-gl/maplibre-gl.mjs").StyleSpecification} Style */

// Colours are told apart by people who see no red or no green (after Okabe and Ito), and nothing is told by colour alone: lines that break
// their promise are dashed and crossed, exclusions hatched, and everything has its words in a table.
const LIGHT = {
  ground: "#f4f5f0", grid: "#c9cdc2", gridMain: "#a8aea0", text: "#14181c", halo: "#ffffff",
  fence: "#8a5a00", free: "#ffffff", kept: "#d8efe4", exclusion: "#7a1f1f", hatch: "#a33b3b",
  keeps: "#005ea8", near: "#8f5d00", breaks: "#b3001b", extrapolated: "#6d3fa0", plain: "#44505c",
  corridor: "#2f7ec2", track: "#1d1d1f", rover: "#0b57d0", roverEdge: "#ffffff", target: "#00664f", draft: "#a3006d",
  manual: "#8a5a00", held: "#b3001b",
};
const DARK = {
  ground: "#14181c", grid: "#2b323a", gridMain: "#3f4852", text: "#f1f4f6", halo: "#0b0e11",
  fence: "#f0b440", free: "#1d242b", kept: "#173a2f", exclusion: "#ff9a8f", hatch: "#d2665d",
  keeps: "#62b5ff", near: "#ffc94d", breaks: "#ff7b72", extrapolated: "#cf9bff", plain: "#b4bfca",
  corridor: "#4a9fe8", track: "#f5f5f5", rover: "#8ec5ff", roverEdge: "#0b0e11", target: "#4fe0b5", draft: "#ff7ccf",
  manual: "#f0b440", held: "#ff7b72",
};

/** @typedef {typeof LIGHT} Colours */

/** @param {boolean} isDark */
export function colours(isDark) {
  return isDark ? DARK : LIGHT;
}

const FONT = ["system-ui", "sans-serif"];
export const SOURCES = ["grid", "meant", "zones", "obstacles", "corridor", "legs", "lines", "mission", "widest", "blockers", "narrow", "track-old", "track",
  "rover", "points", "places", "draft", "draft-points", "along"];

const EMPTY = /** @type {const} */ ({ type: "FeatureCollection", features: [] });

/**
 * @param {boolean} isDark
 * @param {{source: any, attribution: string} | null} tiles
 * @returns {Style}
 */
export function style(isDark, tiles) {
  const colour = colours(isDark);
  /** @type {Record<string, any>} */
  const sources = Object.fromEntries(
    // At zoom 20 a tile's unit is less than a centimetre: as fine as positions are.
    SOURCES.map((name) => [name, { type: "geojson", data: EMPTY, maxzoom: 20, tolerance: 0.2 }]),
  );
  /** @type {Layer[]} */
  const ground = [{ id: "ground", type: "background", paint: { "background-color": colour.ground } }];
  if (tiles) {
    sources.tiles = tiles.source;
    ground.push({ id: "tiles", type: "raster", source: "tiles" });
  }
  return {
    version: 8,
    sources,
    layers: [...ground, ...field(colour, tiles !== null), ...route(colour), ...tracks(colour), ...labels(colour), ...drafts(colour), ...rover(colour)].map(scaled),
  };
}

/**
 * Letters and signs grow with the page's own letters: on a large screen, and for who has set larger ones.
 * @param {Layer} layer
 * @returns {Layer}
 */
function scaled(layer) {
  const scale = letterScale();
  if (layer.type !== "symbol" || !layer.layout) {
    return layer;
  }
  const { "text-size": text, "icon-image": icon } = layer.layout;
  return { ...layer, layout: { ...layer.layout, ...(typeof text === "number" ? { "text-size": text * scale } : {}), ...(icon ? { "icon-size": scale } : {}) } };
}

/**
 * @param {Colours} colour
 * @param {boolean} hasTiles
 * @returns {Layer[]}
 */
function field(colour, hasTiles) {
  return [
    { id: "free", type: "fill", source: "meant", filter: ["==", ["get", "what"], "free"], paint: { "fill-color": colour.free, "fill-opacity": hasTiles ? 0.25 : 0.9 } },
    { id: "kept", type: "fill", source: "meant", filter: ["==", ["get", "what"], "margin"], paint: { "fill-color": colour.kept, "fill-opacity": hasTiles ? 0.35 : 0.85 } },
    { id: "grid", type: "line", source: "grid", layout: { visibility: hasTiles ? "none" : "visible" },
      paint: { "line-color": ["case", ["get", "main"], colour.gridMain, colour.grid], "line-width": ["case", ["get", "main"], 1.2, 0.7] } },
    { id: "exclusions", type: "fill", source: "zones", filter: ["==", ["get", "kind"], "exclusion"], paint: { "fill-pattern": "hatch" } },
    { id: "obstacles", type: "fill", source: "obstacles", paint: { "fill-pattern": "hatch" } },
    { id: "free-edge", type: "line", source: "meant", filter: ["==", ["get", "what"], "free"], paint: { "line-color": colour.fence, "line-width": 1, "line-dasharray": [1, 2] } },
    { id: "home-circle", type: "line", source: "meant", filter: ["==", ["get", "what"], "home circle"], paint: { "line-color": colour.fence, "line-width": 1.5, "line-dasharray": [6, 3, 1, 3] } },
    { id: "zones-edge", type: "line", source: "zones", layout: { "line-join": "round" },
      paint: { "line-color": ["match", ["get", "kind"], "exclusion", colour.exclusion, colour.fence], "line-width": 2.5 } },
    { id: "obstacles-edge", type: "line", source: "obstacles", paint: { "line-color": colour.breaks, "line-width": 2, "line-dasharray": [2, 1] } },
    { id: "blockers", type: "line", source: "blockers", paint: { "line-color": colour.breaks, "line-width": 6, "line-opacity": 0.75 } },
  ];
}

/**
 * @param {Colours} colour
 * @returns {Layer[]}
 */
function route(colour) {
  /** @type {any} */
  const verdict = ["match", ["get", "verdict"], "keeps", colour.keeps, "near", colour.near, "breaks", colour.breaks, "extrapolated", colour.extrapolated, colour.plain];
  /** @type {(id: string, dash: number[] | null) => Layer} */
  const leg = (id, dash) => ({
    id: `leg-${id || "plain"}`, type: "line", source: "legs", filter: ["==", ["get", "verdict"], id], layout: { "line-cap": dash ? "butt" : "round" },
    paint: { "line-color": verdict, "line-width": ["case", ["boolean", ["feature-state", "hover"], false], 8, 4], ...(dash ? { "line-dasharray": dash } : {}) },
  });
  return [
    { id: "corridor", type: "fill", source: "corridor", paint: { "fill-color": colour.corridor, "fill-opacity": 0.28 } },
    { id: "corridor-edge", type: "line", source: "corridor", paint: { "line-color": colour.corridor, "line-width": 1.5 } },
    { id: "blocks", type: "line", source: "lines", filter: ["==", ["get", "name"], ""], paint: { "line-color": colour.plain, "line-width": 0.7 } },
    { id: "lines", type: "line", source: "lines", filter: ["!=", ["get", "name"], ""], paint: { "line-color": colour.target, "line-width": 1.5, "line-dasharray": [5, 3] } },
    { id: "mission", type: "line", source: "mission", paint: { "line-color": colour.plain, "line-width": 2, "line-dasharray": [3, 2] } },
    { id: "widest", type: "line", source: "widest", paint: { "line-color": colour.near, "line-width": 3, "line-dasharray": [4, 2] } },
    leg("keeps", null), leg("near", [4, 1]), leg("breaks", [1.2, 0.8]), leg("extrapolated", [2, 1, 0.5, 1]), leg("", [1, 1]),
    { id: "leg-hit", type: "line", source: "legs", paint: { "line-color": "#000", "line-opacity": 0, "line-width": 22 } },
    { id: "way", type: "symbol", source: "legs", layout: { "symbol-placement": "line", "symbol-spacing": 110, "icon-image": "arrow", "icon-allow-overlap": true, "icon-ignore-placement": true } },
    { id: "narrow", type: "line", source: "narrow", paint: { "line-color": colour.text, "line-width": 2.5 } },
  ];
}

/**
 * @param {Colours} colour
 * @returns {Layer[]}
 */
function tracks(colour) {
  /** @type {any} */
  const byMode = ["match", ["get", "look"], "auto", colour.track, "hold", colour.held, colour.manual];
  /** @type {(source: string) => Layer[]} */
  const track = (source) => [
    { id: source, type: "line", source, filter: ["==", ["get", "look"], "auto"], layout: { "line-join": "round" }, paint: { "line-color": byMode, "line-width": 2 } },
    { id: `${source}-by-hand`, type: "line", source, filter: ["!=", ["get", "look"], "auto"], paint: { "line-color": byMode, "line-width": 2.5, "line-dasharray": [2, 1] } },
  ];
  return [...track("track-old"), ...track("track")];
}

/**
 * @param {Colours} colour
 * @returns {Layer[]}
 */
function rover(colour) {
  return [
    { id: "rover-shape", type: "fill", source: "rover", filter: ["==", ["geometry-type"], "Polygon"], paint: { "fill-color": colour.rover, "fill-opacity": 0.45 } },
    { id: "rover-edge", type: "line", source: "rover", filter: ["==", ["geometry-type"], "Polygon"], paint: { "line-color": colour.rover, "line-width": 2 } },
    { id: "rover", type: "symbol", source: "rover", filter: ["==", ["geometry-type"], "Point"],
      layout: { "icon-image": ["match", ["get", "look"], "lost", "rover-lost", "rover"], "icon-rotate": ["get", "heading"], "icon-rotation-alignment": "map", "icon-allow-overlap": true, "icon-ignore-placement": true } },
  ];
}

/**
 * @param {Colours} colour
 * @returns {Layer[]}
 */
function labels(colour) {
  /** @type {any} */
  const words = { "text-color": colour.text, "text-halo-color": colour.halo, "text-halo-width": 2 };
  /** @type {any} */
  const aside = { "text-font": FONT, "text-variable-anchor": ["left", "right", "top", "bottom"], "text-radial-offset": 0.9, "text-justify": "auto", "text-max-width": 12 };
  return [
    { id: "point-spots", type: "circle", source: "points",
      paint: { "circle-radius": 5, "circle-color": colour.halo, "circle-stroke-width": 2.5, "circle-stroke-color": colour.keeps } },
    { id: "places", type: "symbol", source: "places",
      layout: { "icon-image": ["get", "icon"], "icon-allow-overlap": true, "icon-ignore-placement": true, "icon-anchor": "center" } },
    { id: "place-names", type: "symbol", source: "places", layout: { ...aside, "text-field": ["get", "name"], "text-size": 14, "text-radial-offset": 1.2, "symbol-sort-key": 0 }, paint: words },
    { id: "narrow-name", type: "symbol", source: "narrow", filter: ["==", ["geometry-type"], "Point"], layout: { ...aside, "text-field": ["get", "name"], "text-size": 13, "symbol-sort-key": 1 }, paint: words },
    { id: "point-numbers", type: "symbol", source: "points", layout: { ...aside, "text-field": ["get", "name"], "text-size": 13, "symbol-sort-key": ["get", "order"] }, paint: words },
    { id: "line-names", type: "symbol", source: "lines", layout: { "text-font": FONT, "text-field": ["get", "name"], "text-size": 12, "symbol-placement": "line", "symbol-spacing": 400, "text-offset": [0, 0.9], "symbol-sort-key": 960 }, paint: { ...words, "text-color": colour.target } },
    { id: "inclusion-names", type: "symbol", source: "zones", minzoom: 15, filter: ["==", ["get", "kind"], "inclusion"],
      layout: { "text-font": FONT, "text-field": ["get", "name"], "text-size": 12, "symbol-placement": "line", "symbol-spacing": 600, "text-offset": [0, 0.9], "symbol-sort-key": 950 }, paint: { ...words, "text-color": colour.fence } },
    { id: "zone-names", type: "symbol", source: "zones", minzoom: 15, filter: ["==", ["get", "kind"], "exclusion"], layout: { "text-font": FONT, "text-field": ["get", "name"], "text-size": 12, "text-max-width": 8, "symbol-sort-key": 900 },
      paint: { ...words, "text-color": colour.exclusion } },
  ];
}

/**
 * @param {Colours} colour
 * @returns {Layer[]}
 */
function drafts(colour) {
  return [
    { id: "draft-fill", type: "fill", source: "draft", filter: ["==", ["geometry-type"], "Polygon"], paint: { "fill-color": colour.draft, "fill-opacity": 0.15 } },
    { id: "draft-edge", type: "line", source: "draft", paint: { "line-color": colour.draft, "line-width": 3, "line-dasharray": [2, 1] } },
    { id: "along", type: "circle", source: "along", paint: { "circle-radius": 8, "circle-color": colour.draft, "circle-stroke-width": 2.5, "circle-stroke-color": colour.halo } },
    { id: "draft-points", type: "circle", source: "draft-points", paint: { "circle-radius": ["case", ["get", "middle"], 4, 6], "circle-color": colour.halo, "circle-stroke-width": 2.5, "circle-stroke-color": colour.draft } },
  ];
}

/** The map itself: MapLibre with nothing from outside, its sources filled by others. */

import * as maplibre from "../vendor/maplibre-gl/maplibre-gl.mjs";
import { box, places } from "../geo.js";
import { isServed, ownWorkerUrl } from "../inside.js";
import { texts } from "../texts.js";
import { gridLines } from "./grid.js";
import { addIcons } from "./icons.js";
import { SOURCES, style } from "./style.js";
import { tileSource } from "./tiles.js";

/** @typedef {import("../geo.js").Place} Place */

maplibre.setWorkerUrl(ownWorkerUrl() ?? new URL("../vendor/maplibre-gl/maplibre-gl-worker.mjs", import.meta.url).href);

const FIT_PADDING_PX = { top: 70, right: 40, bottom: 50, left: 40 }; // tools above, the scale bar below
const FIT_ZOOM = 20.5; // the nearest look that "fit" takes: some ten metres; chosen
const DARK = matchMedia("(prefers-color-scheme: dark)");

/** Whether this browser draws maps at all. */
export function hasWebGl() {
  try {
    return document.createElement("canvas").getContext("webgl2") !== null;
  } catch {
    return false;
  }
}

export class MapView {
  /**
   * @param {HTMLElement} container
   * @param {import("../types.js").MapSource | null} tiles
   */
  constructor(container, tiles) {
    this.tiles = tiles;
    /** @type {Map<string, any>} what each source holds: put back when the style changes */
    this.data = new Map();
    /** @type {Place | null} */
    this.gridOrigin = null;
    /** @type {import("../types.js").Box | null} */
    this.wanted = null;
    this.isReady = false;
    /** @type {(() => void)[]} */
    this.waiting = [];
    this.map = new maplibre.Map({
      container, style: style(DARK.matches, tileSource(tiles)), center: [0, 0], zoom: 1, maxZoom: 24, attributionControl: false, dragRotate: true,
      pitchWithRotate: false, maxPitch: 0, renderWorldCopies: false, fadeDuration: 0, clickTolerance: 4, cancelPendingTileRequestsWhileZooming: true,
      locale: texts.map.controls,
    });
    this.map.getCanvas().setAttribute("aria-label", isServed ? texts.map.name : texts.map.nameHere);
    this.map.addControl(new maplibre.NavigationControl({ visualizePitch: false }), "top-right");
    this.map.addControl(new maplibre.ScaleControl({ unit: "metric", maxWidth: 140 }), "bottom-left");
    if (tiles?.attribution) {
      this.map.addControl(new maplibre.AttributionControl({ compact: true, customAttribution: plain(tiles.attribution) }), "bottom-right");
    }
    this.map.touchZoomRotate.enable();
    this.map.on("style.load", () => this.begin());
    this.map.on("move", () => this.drawGrid());
    this.map.on("resize", () => this.drawGrid());
    DARK.addEventListener("change", () => this.restyle());
  }

  begin() {
    addIcons(this.map, DARK.matches);
    this.isReady = true;
    for (const [source, data] of this.data) {
      this.fill(source, data);
    }
    this.drawGrid();
    this.waiting.splice(0).forEach((act) => act());
    /** @type {HTMLElement} */ (this.map.getContainer().parentElement).dataset.ready = "yes";
  }

  restyle() {
    this.isReady = false;
    this.map.setStyle(style(DARK.matches, tileSource(this.tiles)), { diff: false });
  }

  /** @param {() => void} act what to do once the map can draw */
  whenReady(act) {
    if (this.isReady) {
      act();
    } else {
      this.waiting.push(act);
    }
  }

  /**
   * Show other features in a source.
   * @param {string} source one of `SOURCES`
   * @param {any[]} features
   */
  set(source, features) {
    const data = { type: "FeatureCollection", features };
    this.data.set(source, data);
    if (this.isReady) {
      this.fill(source, data);
    }
  }

  /**
   * @param {string} source
   * @param {any} data
   */
  fill(source, data) {
    /** @type {any} */ (this.map.getSource(source))?.setData(data);
  }

  /** @param {Place} origin */
  setOrigin(origin) {
    if (!this.gridOrigin || Math.abs(this.gridOrigin[0] - origin[0]) + Math.abs(this.gridOrigin[1] - origin[1]) > 1e-7) {
      this.gridOrigin = origin;
      this.drawGrid();
    }
  }

  drawGrid() {
    if (!this.isReady || !this.gridOrigin || this.tiles || this.map.getZoom() < 9) {
      return;
    }
    const bounds = this.map.getBounds();
    const view = { west: bounds.getWest(), south: bounds.getSouth(), east: bounds.getEast(), north: bounds.getNorth() };
    this.fill("grid", gridLines(this.gridOrigin, view, this.pixel_m()));
  }

  /** How many metres a pixel is, at the middle of the map. */
  pixel_m() {
    const latitude = this.map.getCenter().lat;
    return (40_075_016.686 * Math.cos((latitude * Math.PI) / 180)) / (512 * 2 ** this.map.getZoom());
  }

  /**
   * Show all of some features.
   * @param {string[]} sources
   * @param {boolean} [isSudden]
   */
  fit(sources, isSudden = false) {
    const all = sources.flatMap((name) => this.data.get(name)?.features ?? []);
    // A home circle may be vast: it counts only where nothing else does.
    const bounds = box((all.length > 0 ? all : this.data.get("meant")?.features ?? []).flatMap((/** @type {any} */ feature) => [...places(feature.geometry.coordinates)]));
    if (bounds) {
      this.map.fitBounds(bounds, { padding: FIT_PADDING_PX, maxZoom: FIT_ZOOM, bearing: 0, duration: isSudden ? 0 : 300 });
    }
  }

  /** @returns {Place} */
  middle() {
    const { lng, lat } = this.map.getCenter();
    return [lng, lat];
  }

  /**
   * @param {Place} place
   * @param {number} [zoom]
   */
  show(place, zoom) {
    this.map.easeTo({ center: place, ...(zoom ? { zoom } : {}), duration: 250 });
  }

  /**
   * Mark a leg as hovered.
   * @param {number | null} index
   * @param {number | null} before
   */
  hoverLeg(index, before) {
    for (const [id, hover] of /** @type {[number | null, boolean][]} */ ([[before, false], [index, true]])) {
      if (id !== null && this.isReady) {
        this.map.setFeatureState({ source: "legs", id }, { hover });
      }
    }
  }

  /** The view as a PNG. */
  picture() {
    // A drawing is kept until the next one only while it is being shown.
    return new Promise((resolve) => {
      this.map.once("render", () => this.map.getCanvas().toBlob(resolve, "image/png"));
      this.map.triggerRepaint();
    });
  }
}

/** @param {string} text MapLibre takes markup for the attribution; what comes from outside is none */
function plain(text) {
  return text.replace(/[&<>"']/g, (sign) => `&#${sign.charCodeAt(0)};`);
}

export { maplibre, SOURCES };

/** What can be dragged on the map: a button at each place, for mouse, finger and keyboard. What it looks like is drawn by the map below it. */

import { moved } from "../geo.js";
import { h } from "../dom.js";
import { texts } from "../texts.js";
import { maplibre } from "./view.js";

/** @typedef {import("../geo.js").Place} Place */
/**
 * @typedef {object} Handle
 * @property {string} id
 * @property {Place} at
 * @property {string} label
 * @property {string} [look] a class
 * @property {boolean} [isTabStop]
 * @property {(at: Place, isLast: boolean) => void} onmove
 * @property {() => void} [onremove]
 * @property {() => void} [onpick]
 */

const STEP_M = 0.25; // an arrow key moves by this; with shift ten times as far; chosen
const ARROWS = /** @type {Record<string, [number, number]>} */ ({ ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] });

export class Handles {
  /** @param {import("./view.js").MapView} view */
  constructor(view) {
    this.view = view;
    /** @type {Map<string, {marker: maplibre.Marker, element: HTMLButtonElement, handle: Handle}>} */
    this.shown = new Map();
    /** @type {string | null} */
    this.dragged = null;
  }

  /** @param {Handle[]} handles */
  set(handles) {
    const wanted = new Map(handles.map((handle) => [handle.id, handle]));
    for (const [id, { marker }] of this.shown) {
      if (!wanted.has(id)) {
        marker.remove();
        this.shown.delete(id);
      }
    }
    for (const handle of handles) {
      const known = this.shown.get(handle.id);
      if (known) {
        known.handle = handle;
        if (this.dragged !== handle.id) {
          known.marker.setLngLat(handle.at);
        }
      } else {
        this.add(handle);
      }
      this.describe(handle);
    }
  }

  /** @param {string} id */
  focus(id) {
    this.shown.get(id)?.element.focus();
  }

  /** @param {Handle} handle */
  add(handle) {
    const element = h("button", { type: "button", class: "handle" });
    const marker = new maplibre.Marker({ element, draggable: true }).setLngLat(handle.at).addTo(this.view.map);
    this.shown.set(handle.id, { marker, element, handle });
    const now = () => /** @type {Handle} */ (this.shown.get(handle.id)?.handle);
    const place = () => /** @type {Place} */ (marker.getLngLat().toArray());
    marker.on("dragstart", () => { this.dragged = handle.id; });
    marker.on("drag", () => now().onmove(place(), false));
    marker.on("dragend", () => { this.dragged = null; now().onmove(place(), true); });
    element.addEventListener("keydown", (event) => this.press(event, now(), place()));
    element.addEventListener("click", (event) => { event.stopPropagation(); now().onpick?.(); });
  }

  /** @param {Handle} handle */
  describe(handle) {
    const element = /** @type {HTMLButtonElement} */ (this.shown.get(handle.id)?.element);
    element.tabIndex = handle.isTabStop === false ? -1 : 0;
    element.setAttribute("aria-label", `${handle.label}. ${handle.onremove ? texts.map.handleKeysRemove : texts.map.handleKeys}`);
    element.title = handle.label;
    for (const name of ["middle", "corner", "target-handle", "point-handle"]) {
      element.classList.toggle(name, handle.look === name);
    }
  }

  /**
   * @param {KeyboardEvent} event
   * @param {Handle} handle
   * @param {Place} at
   */
  press(event, handle, at) {
    const way = ARROWS[event.key];
    if (way) {
      const step_m = STEP_M * (event.shiftKey ? 10 : 1);
      handle.onmove(moved(at, way[0] * step_m, way[1] * step_m), true);
    } else if ((event.key === "Delete" || event.key === "Backspace") && handle.onremove) {
      handle.onremove();
    } else {
      return;
    }
    event.preventDefault();
    event.stopPropagation();
  }
}

/** What is done on the map with mouse and finger, and with keys where the map has the focus: targets, waypoints, fences. */

import { ringOf } from "../doc.js";
import { isServed } from "../inside.js";
import { distance_m, moved, rounded } from "../geo.js";
import { middle } from "../panels/fence.js";
import { texts } from "../texts.js";
import { feature, line, spot } from "./features.js";
import { Handles } from "./handles.js";

/** @typedef {import("../geo.js").Place} Place */
/** @typedef {import("../types.js").PageState} PageState */
/** @typedef {import("../types.js").Zone} Zone */
/** @typedef {import("./handles.js").Handle} Handle */

const MOST_POINTS = 60; // waypoints that get a handle on the map; all can be typed. Chosen: more would not be hit
const CLOSE_PX = 14; // a click so near to the first corner closes the ring

export class Pointing {
  /**
   * @param {import("./view.js").MapView} view
   * @param {import("../store.js").Store<PageState>} store
   * @param {import("../actions.js").Actions} act
   */
  constructor(view, store, act) {
    this.view = view;
    this.store = store;
    this.act = act;
    this.handles = new Handles(view);
    const { map } = view;
    map.on("mousemove", (event) => this.hover([event.lngLat.lng, event.lngLat.lat], event.point));
    map.on("mouseout", () => store.state.hoverLeg !== null && store.set({ hoverLeg: null }));
    if (!isServed) {
      return; // a page that is one file shows: nothing can be asked for
    }
    map.on("click", (event) => this.click([event.lngLat.lng, event.lngLat.lat], event.point));
    map.getCanvas().addEventListener("keydown", (event) => this.press(event));
    map.doubleClickZoom.disable();
    view.whenReady(() => store.watch(["doc", "plan", "zone", "tool", "drawn"], (state) => this.show(state)));
  }

  /** The corners of what is being drawn. */
  get drawn() {
    return this.store.state.drawn;
  }

  set drawn(drawn) {
    this.store.set({ drawn });
  }

  /**
   * @param {Place} place
   * @param {any} [point] where on the screen
   */
  click(place, point) {
    const { tool } = this.store.state;
    if (tool === "target" || tool === "add") {
      const isMore = tool === "add";
      if (isMore) {
        this.act.addTarget(place);
      } else {
        this.act.setTarget(place);
      }
    } else if (tool === "start") {
      this.act.setStart(place);
      this.store.set({ tool: "target" });
    } else if (tool === "polygon" || tool === "circle") {
      this.draw(place, tool);
    } else if (this.store.state.doc.zones !== null && point) {
      const [zone] = this.view.map.queryRenderedFeatures([[point.x - 6, point.y - 6], [point.x + 6, point.y + 6]], { layers: ["zones-edge", "exclusions"] });
      this.store.set({ zone: zone ? zone.properties.index : null });
    }
  }

  /**
   * @param {Place} place
   * @param {"polygon" | "circle"} tool
   */
  draw(place, tool) {
    const kind = this.store.state.newKind;
    const [first] = this.drawn;
    if (tool === "circle" && first) {
      this.drawn = [];
      this.act.addZone({ kind, shape: "circle", centre: rounded(first), radius_m: Math.max(0.1, Math.round(distance_m(first, place) * 100) / 100) });
    } else if (tool === "polygon" && this.drawn.length >= 3 && this.isNear(first, place)) {
      this.close();
    } else {
      this.drawn = [...this.drawn, rounded(place)];
    }
    this.showDraft(null);
  }

  /** Make a zone of the corners drawn so far. */
  close() {
    if (this.store.state.tool === "polygon" && this.drawn.length >= 3) {
      const ring = this.drawn;
      this.drawn = [];
      this.act.addZone({ kind: this.store.state.newKind, shape: "polygon", ring });
      this.showDraft(null);
    }
  }

  giveUp() {
    this.drawn = [];
    this.store.set({ tool: "none", zone: null });
    this.showDraft(null);
  }

  /**
   * @param {Place} a
   * @param {Place} b
   */
  isNear(a, b) {
    return distance_m(a, b) < CLOSE_PX * this.view.pixel_m();
  }

  /**
   * @param {Place} place
   * @param {any} point
   */
  hover(place, point) {
    if (this.drawn.length > 0) {
      this.showDraft(place);
      return;
    }
    const [leg] = this.view.isReady ? this.view.map.queryRenderedFeatures(point, { layers: ["leg-hit"] }) : [];
    const index = leg ? Number(leg.id) : null;
    if (index !== this.store.state.hoverLeg) {
      this.store.set({ hoverLeg: index });
    }
  }

  /** @param {KeyboardEvent} event */
  press(event) {
    if (event.key === "t" || event.key === "T") {
      this.click(this.view.middle());
    } else if (event.key === "Enter") {
      this.close();
    } else if (event.key === "Escape") {
      this.giveUp();
    } else {
      return;
    }
    event.preventDefault();
  }

  /** @param {PageState} state */
  show(state) {
    const isDrawing = state.tool === "polygon" || state.tool === "circle";
    if (!isDrawing && state.drawn.length > 0) {
      this.drawn = [];
    }
    this.view.map.getCanvas().style.cursor = state.tool === "none" ? "" : "crosshair";
    this.handles.set(isDrawing ? [] : [...this.zoneHandles(state), ...this.targetHandles(state), ...this.pointHandles(state)]);
    this.showDraft(null);
  }

  /** @param {PageState} state @returns {Handle[]} */
  targetHandles({ doc }) {
    /** @type {Handle[]} */
    const start = doc.start ? [{ id: "start", at: doc.start, label: texts.plan.start, look: "target-handle", onmove: (place, isLast) => isLast && this.act.setStart(place), onremove: () => this.act.setStart(null) }] : [];
    return [...start, ...doc.targets.map((at, i) => ({
      id: `target ${i}`, at, label: doc.targets.length > 1 ? texts.map.targetOf(i + 1) : texts.map.target, look: "target-handle",
      onmove: (/** @type {Place} */ place, /** @type {boolean} */ isLast) => this.act.moveTarget(i, place, isLast), onremove: () => this.act.removeTarget(i),
    }))];
  }

  /** @param {PageState} state @returns {Handle[]} */
  pointHandles({ doc, plan, zone }) {
    const found = doc.mission ? doc.mission.points : (plan?.points ?? []).slice(1).map((point) => point.at);
    if (zone !== null || found.length > MOST_POINTS || (doc.mission === null && doc.targets.length === 0)) {
      return [];
    }
    const isTarget = (/** @type {Place} */ at) => doc.mission === null && doc.targets.some((target) => this.isNear(target, at));
    return found.flatMap((at, i) => (isTarget(at) ? [] : [{
      id: `point ${i}`, at, label: texts.map.point(i + 1), look: "point-handle", isTabStop: i === 0,
      onmove: (/** @type {Place} */ place, /** @type {boolean} */ isLast) => this.act.movePoint(i, place, isLast), onremove: () => this.act.removePoint(i),
    }]));
  }

  /** @param {PageState} state @returns {Handle[]} */
  zoneHandles({ doc, zone }) {
    const edited = zone === null ? null : doc.zones?.[zone];
    if (!edited || zone === null) {
      return [];
    }
    return edited.shape === "circle" ? this.circleHandles(edited, zone) : this.cornerHandles(edited.ring, zone);
  }

  /**
   * @param {Extract<Zone, {shape: "circle"}>} circle
   * @param {number} zone
   * @returns {Handle[]}
   */
  circleHandles(circle, zone) {
    return [
      { id: "centre", at: circle.centre, label: texts.map.centre, look: "corner", onmove: (place, isLast) => this.act.moveCorner(zone, 0, place, isLast) },
      { id: "rim", at: moved(circle.centre, circle.radius_m, 0), label: texts.map.rim, look: "corner",
        onmove: (place, isLast) => this.act.setRadius(zone, distance_m(circle.centre, place), isLast) },
    ];
  }

  /**
   * @param {Place[]} ring
   * @param {number} zone
   * @returns {Handle[]}
   */
  cornerHandles(ring, zone) {
    return ring.flatMap((at, i) => {
      const half = middle(at, ring[(i + 1) % ring.length]);
      return [
        { id: `corner ${zone} ${i}`, at, label: texts.map.corner(i + 1), look: "corner",
          onmove: (/** @type {Place} */ place, /** @type {boolean} */ isLast) => this.act.moveCorner(zone, i, place, isLast), onremove: () => this.act.removeCorner(zone, i) },
        { id: `middle ${zone} ${i} ${ring.length}`, at: half, label: texts.map.between(i + 1), look: "middle", isTabStop: false,
          onmove: (/** @type {Place} */ place, /** @type {boolean} */ isLast) => isLast && this.act.addCorner(zone, i + 1, place), onpick: () => this.act.addCorner(zone, i + 1, half) },
      ];
    });
  }

  /** What is being drawn, and the drawn zones. @param {Place | null} cursor */
  showDraft(cursor) {
    const { doc, zone, tool } = this.store.state;
    const [first] = this.drawn;
    const found = (doc.zones ?? []).map((one, i) => line(ringOf(one), { edited: i === zone }));
    const edited = zone === null ? null : doc.zones?.[zone];
    if (edited) {
      found.push(feature({ type: "Polygon", coordinates: [ringOf(edited)] }));
    }
    if (first && tool === "circle" && cursor) {
      found.push(feature({ type: "Polygon", coordinates: [ringOf({ kind: "exclusion", shape: "circle", centre: first, radius_m: distance_m(first, cursor) })] }));
    } else if (first) {
      found.push(line(cursor ? [...this.drawn, cursor] : this.drawn.length > 1 ? this.drawn : [first, first]));
    }
    this.view.set("draft", found);
    const corners = edited?.shape === "polygon" ? edited.ring : edited?.shape === "circle" ? [edited.centre, moved(edited.centre, edited.radius_m, 0)] : [];
    const middles = edited?.shape === "polygon" ? edited.ring.map((at, i) => middle(at, edited.ring[(i + 1) % edited.ring.length])) : [];
    this.view.set("draft-points", [...middles.map((at) => spot(at, { middle: true })), ...[...this.drawn, ...corners].map((at) => spot(at, { middle: false }))]);
  }
}

/** Keeps the map as the page's state is: each source is filled anew when what it shows has changed. */

import { box, places } from "../geo.js";
import { letterScale } from "../dom.js";
import { lookOf } from "../modes.js";
import { nearest } from "../profile.js";
import * as features from "./features.js";
import { Track } from "./track.js";

/** @typedef {import("../types.js").PageState} PageState */
/** @typedef {import("./view.js").MapView} MapView */

const FITTED = ["zones", "legs", "mission", "rover", "places", "draft"];

export class Scene {
  /**
   * @param {MapView} view
   * @param {import("../store.js").Store<PageState>} store
   */
  constructor(view, store) {
    this.view = view;
    this.store = store;
    this.track = new Track(view, (mode) => lookOf(mode, store.state.vehicle.autopilot));
    this.isFitted = false;
    this.fitted = FITTED;
    this.isFollowing = false;
    /** @type {number | null} */
    this.hovered = null;
    /** @type {Map<string, string>} what some sources hold, to fill them only with something else */
    this.held = new Map();
    view.whenReady(() => this.begin());
    // As long as nobody has moved the map it shows all, whatever room it has.
    this.isMoved = false;
    this.isFar = false;
    for (const kind of /** @type {const} */ (["dragstart", "zoomstart", "rotatestart"])) {
      view.map.on(kind, (event) => { this.isMoved ||= "originalEvent" in event && Boolean(event.originalEvent); });
    }
    view.map.on("zoomend", () => view.isReady && this.showZones());
    view.map.on("resize", () => this.isFitted && !this.isMoved && !this.isFollowing && this.fit(true));
  }

  begin() {
    const { store, view } = this;
    store.watch(["fence", "looked", "doc"], ({ fence, looked, doc }) => {
      const shown = doc.zones !== null && looked ? looked : fence;
      view.set("meant", features.meant(shown));
      this.showZones();
      view.set("obstacles", features.obstacles(fence));
    });
    store.watch(["plan"], ({ plan }) => {
      view.hoverLeg(null, this.hovered);
      this.hovered = null;
      store.set({ hoverLeg: null });
      view.set("legs", features.legs(plan));
      view.set("corridor", features.corridor(plan));
      view.set("narrow", features.narrowest(plan));
      view.set("widest", features.widest(plan));
      view.set("blockers", features.blockers(plan));
      view.set("points", features.points(plan));
    });
    store.watch(["mission", "plan"], ({ mission, plan }) => view.set("mission", mission && !(mission.matches_plan && plan?.by === "director") && mission.points.length > 1 ? [features.line(mission.points)] : []));
    store.watch(["doc", "home", "rally", "plan", "drive", "vehicle", "marks"], (state) => this.setIfOther("places", features.marks(state)));
    store.watch(["lines"], ({ lines }) => view.set("lines", features.lines(lines)));
    store.watch(["doc"], (state) => this.showTargets(state));
    store.watch(["vehicle", "link"], (state) => this.showRover(state));
    store.watch(["hoverLeg"], ({ hoverLeg }) => { view.hoverLeg(hoverLeg, this.hovered); this.hovered = hoverLeg; });
    store.watch(["hoverAlong_m"], (state) => this.showAlong(state));
    store.watch(["home", "fence", "vehicle"], (state) => this.fitOnce(state));
  }

  /** The zones, with the names that have room as far as the map is zoomed in. */
  showZones() {
    const { fence, looked, doc } = this.store.state;
    const shown = doc.zones !== null && looked ? looked : fence;
    const look = { pixel_m: this.view.pixel_m(), scale: letterScale() };
    this.setIfOther("zones", doc.zones === null || looked?.held.features.length ? features.zones(shown, look) : []);
  }

  /** @param {PageState} state */
  showRover(state) {
    this.setIfOther("rover", features.rover(state));
    if (this.isFollowing && state.vehicle.position) {
      this.view.map.easeTo({ center: state.vehicle.position, duration: 0 });
    }
  }

  /**
   * Fill a source only where something in it has changed.
   * @param {string} source
   * @param {any[]} found
   */
  setIfOther(source, found) {
    const text = JSON.stringify(found);
    if (this.held.get(source) !== text) {
      this.held.set(source, text);
      this.view.set(source, found);
    }
  }

  /** The place along the route that is pointed at in the profile. @param {PageState} state */
  showAlong({ hoverAlong_m, plan }) {
    const sample = hoverAlong_m === null || !plan ? null : nearest(plan.profile, hoverAlong_m);
    const at = sample && plan ? alongRoute(plan, sample.s_m) : null;
    this.view.set("along", at ? [features.spot(at)] : []);
  }

  /** @param {PageState} state */
  fitOnce({ home, fence, vehicle }) {
    const middle = box([...fence.held.features.flatMap((zone) => [...places(zone.geometry.coordinates)])]);
    const origin = home ?? (middle ? /** @type {import("../geo.js").Place} */ ([(middle[0] + middle[2]) / 2, (middle[1] + middle[3]) / 2]) : vehicle.position);
    if (origin) {
      this.view.setOrigin(origin);
    }
    if (!this.isFitted && middle) {
      this.isFitted = true;
      this.fit(true);
    } else if (!this.isFitted && vehicle.position) {
      this.view.map.jumpTo({ center: vehicle.position, zoom: 18 });
    }
  }

  /** A target that was typed may lie beyond the fence, and so beyond what is seen. @param {PageState} state */
  showTargets({ doc, fence }) {
    const seen = box(fence.held.features.flatMap((zone) => [...places(zone.geometry.coordinates)]));
    const isFar = seen !== null && doc.targets.some(([lon, lat]) => lon < seen[0] || lon > seen[2] || lat < seen[1] || lat > seen[3]);
    if (isFar !== this.isFar && this.isFitted && !this.isMoved && !this.isFollowing) {
      this.fit();
    }
    this.isFar = isFar;
  }

  /** @param {boolean} [isSudden] */
  fit(isSudden = false) {
    this.isMoved = false;
    this.view.fit(this.fitted, isSudden);
  }

  /** Show the whole track too, from the beginning: there is no rover to follow in a page that is one file. */
  showAll() {
    this.fitted = [...FITTED, "lines", "track-old", "track"];
    this.view.whenReady(() => { this.track.draw(true); this.isFitted = true; this.fit(true); });
  }
}

/**
 * The place so far along a route.
 * @param {import("../types.js").Plan} plan
 * @param {number} along_m
 * @returns {import("../geo.js").Place | null}
 */
export function alongRoute(plan, along_m) {
  let left_m = along_m;
  for (const leg of plan.legs) {
    if (left_m <= leg.length_m || leg === plan.legs.at(-1)) {
      const share = leg.length_m > 0 ? Math.min(1, left_m / leg.length_m) : 0;
      return [leg.start[0] + share * (leg.end[0] - leg.start[0]), leg.start[1] + share * (leg.end[1] - leg.start[1])];
    }
    left_m -= leg.length_m;
  }
  return null;
}

/** Everything that a person can do on this page, whatever it is done with: the map, a panel, or a key. */

import { postForFile, post } from "./connection.js";
import { EMPTY, fenceBody, inserted, missionBody, replaced, startBody, swapped, without, zonesOf } from "./doc.js";
import { saveAs, shownName } from "./dom.js";
import { rounded } from "./geo.js";
import { History } from "./history.js";
import { refusal } from "./planner.js";
import { texts } from "./texts.js";

/** @typedef {import("./geo.js").Place} Place */
/** @typedef {import("./types.js").Doc} Doc */
/** @typedef {import("./types.js").PageState} PageState */
/** @typedef {import("./types.js").Zone} Zone */

const MOST_BYTES = 4 * 1024 * 1024; // as the server takes (wire.MOST_BYTES): a larger file would be sent for nothing

export class Actions {
  /**
   * @param {import("./store.js").Store<PageState>} store
   * @param {import("./planner.js").Planner} planner
   * @param {(text: string, isTrouble: boolean) => void} tell
   */
  constructor(store, planner, tell) {
    this.store = store;
    this.planner = planner;
    this.tell = tell;
    /** @type {Zone[] | null} */
    this.sentZones = null;
    this.hasGiven = false; // control, by a person here
    /** Files that are opened come one after the other: a fence, and then the mission in it. */
    this.opening = Promise.resolve(true);
    store.watch(["upload"], () => this.sentZones && this.seeTransfer());
    this.history = new History(/** @type {Doc} */ (EMPTY), (doc) => {
      const zone = store.state.zone;
      store.set({ doc, zone: zone !== null && zone < (doc.zones?.length ?? 0) ? zone : null });
      planner.change();
    });
  }

  /**
   * @param {string} name
   * @param {Partial<Doc>} parts
   * @param {string | null} [gesture]
   */
  change(name, parts, gesture = null) {
    this.history.change(name, { ...this.history.value, ...parts }, gesture);
  }

  undo() {
    const { drawn } = this.store.state;
    if (drawn.length > 0) {
      this.store.set({ drawn: drawn.slice(0, -1) });
      this.tell(texts.tools.undone(texts.steps.drawnCorner), false);
      return;
    }
    this.tell(texts.tools.undone(this.history.undo()), false);
  }

  redo() {
    this.tell(texts.tools.redone(this.history.redo()), false);
  }

  // Targets

  /** @param {Place} place */
  setTarget(place) {
    this.change(texts.steps.target, { targets: [rounded(place)], mission: null });
  }

  /** @param {Place | null} place */
  setStart(place) {
    this.change(texts.steps.start, { start: place && rounded(place) });
  }

  /** @param {Place} place */
  addTarget(place) {
    this.change(texts.steps.addTarget, { targets: [...this.history.value.targets, rounded(place)], mission: null });
  }

  /**
   * @param {number} index
   * @param {Place} place
   * @param {boolean} [isLast]
   */
  moveTarget(index, place, isLast = true) {
    this.change(texts.steps.moveTarget, { targets: replaced(this.history.value.targets, index, rounded(place)) }, `target ${index}`);
    if (isLast) {
      this.history.settle();
    }
  }

  /** @param {number} index */
  removeTarget(index) {
    this.change(texts.steps.removeTarget, { targets: without(this.history.value.targets, index) });
  }

  /**
   * @param {number} from
   * @param {number} to
   */
  swapTargets(from, to) {
    this.change(texts.steps.orderTargets, { targets: swapped(this.history.value.targets, from, to), order: "given" });
  }

  /**
   * @param {number | null} clearance_m
   * @param {boolean} [isLast]
   */
  setClearance(clearance_m, isLast = true) {
    this.change(texts.steps.clearance, { clearance_m, widest: false }, "clearance");
    if (isLast) {
      this.history.settle();
    }
  }

  askWidest() {
    this.change(texts.steps.clearance, { widest: true });
  }

  clear() {
    this.change(texts.steps.clear, { targets: [], mission: null });
  }

  // Waypoints

  /**
   * Move a waypoint of the shown route by hand: from then on it is checked, not planned.
   * @param {number} index of the route's points, the start not counted
   * @param {Place} place
   * @param {boolean} [isLast]
   */
  movePoint(index, place, isLast = true) {
    const points = this.history.value.mission?.points ?? routePoints(this.store.state.plan);
    const mission = { name: "", points: replaced(points, index, rounded(place)), items: null };
    this.change(texts.steps.movePoint, { mission }, `point ${index}`);
    if (isLast) {
      this.history.settle();
    }
  }

  /** @param {number} index */
  removePoint(index) {
    const points = this.history.value.mission?.points ?? routePoints(this.store.state.plan);
    this.change(texts.steps.movePoint, { mission: { name: "", points: without(points, index), items: null } });
  }

  backToPlanning() {
    this.change(texts.steps.plannedRoute, { mission: null });
  }

  async repair() {
    const { mission, zones, clearance_m } = this.history.value;
    if (!mission) {
      return;
    }
    this.planner.makeRoom();
    const isDone = await this.attempt(texts.plan.repair, async () => {
      const plan = await post("/api/repair", { ...missionBody(mission), ...fenceBody(zones), ...startBody(this.history.value), ...(clearance_m === null ? {} : { clearance_m }) });
      this.change(texts.steps.repair, { mission: { name: mission.name, points: routePoints(plan), items: null } });
      this.store.set({ plan, planTrouble: null, isPlanning: false });
      this.planner.show(this.history.value);
    });
    if (!isDone) {
      this.planner.change(true);
    }
  }

  // The fence

  takeFence() {
    const { fence } = this.store.state;
    this.change(texts.steps.takeFence, { zones: zonesOf(fence) });
  }

  heldFence() {
    this.change(texts.steps.heldFence, { zones: null });
  }

  /** @param {Zone} zone */
  addZone(zone) {
    const zones = this.zones();
    this.change(texts.steps.zone, { zones: [...zones, zone] });
    this.store.set({ zone: zones.length, tool: "none" });
  }

  /**
   * @param {number} index
   * @param {Zone} zone
   * @param {string} name
   * @param {string | null} [gesture]
   */
  changeZone(index, zone, name, gesture = null) {
    this.change(name, { zones: replaced(this.zones(), index, zone) }, gesture);
  }

  /** @param {number} index */
  removeZone(index) {
    this.change(texts.steps.removeZone, { zones: without(this.zones(), index) });
    this.store.set({ zone: null });
  }

  /**
   * @param {number} index
   * @param {number} corner
   * @param {Place} place
   * @param {boolean} [isLast]
   */
  moveCorner(index, corner, place, isLast = true) {
    const zone = this.zones()[index];
    const next = zone.shape === "circle" ? { ...zone, centre: rounded(place) } : { ...zone, ring: replaced(zone.ring, corner, rounded(place)) };
    this.changeZone(index, next, texts.steps.moveCorner, `corner ${index} ${corner}`);
    if (isLast) {
      this.history.settle();
    }
  }

  /**
   * @param {number} index
   * @param {number} radius_m
   * @param {boolean} [isLast]
   */
  setRadius(index, radius_m, isLast = true) {
    const zone = this.zones()[index];
    if (zone.shape === "circle" && radius_m > 0) {
      this.changeZone(index, { ...zone, radius_m: Math.round(radius_m * 100) / 100 }, texts.steps.radius, `radius ${index}`);
    }
    if (isLast) {
      this.history.settle();
    }
  }

  /**
   * @param {number} index
   * @param {number} corner
   * @param {Place} place
   */
  addCorner(index, corner, place) {
    const zone = this.zones()[index];
    if (zone.shape === "polygon") {
      this.changeZone(index, { ...zone, ring: inserted(zone.ring, corner, rounded(place)) }, texts.steps.addCorner);
    }
  }

  /**
   * @param {number} index
   * @param {number} corner
   */
  removeCorner(index, corner) {
    const zone = this.zones()[index];
    if (zone.shape === "polygon" && zone.ring.length > 3) {
      this.changeZone(index, { ...zone, ring: without(zone.ring, corner) }, texts.steps.removeCorner);
    }
  }

  /** @returns {Zone[]} */
  zones() {
    return this.history.value.zones ?? zonesOf(this.store.state.fence);
  }

  // The vehicle

  /**
   * Stop the rover. Needs no control, and is not held up by anything.
   */
  async hold() {
    this.store.set({ holdSent: texts.hold.sending });
    try {
      await post("/api/hold", {}, AbortSignal.timeout(5000));
      this.store.set({ holdSent: "" });
    } catch (error) {
      this.store.set({ holdSent: texts.hold.failed(refusal(error).message) });
    }
  }

  upload() {
    return this.attempt(texts.plan.upload, async () => {
      const { plan } = this.store.state;
      this.tell((await post("/api/upload", { plan_id: plan?.id ?? "" })).text, false);
    });
  }

  uploadFence() {
    return this.attempt(texts.fence.upload, async () => {
      this.sentZones = this.history.value.zones;
      this.tell((await post("/api/upload", fenceBody(this.zones()))).text, false);
    });
  }

  /** A fence that was drawn and sent from here is the held one once it is verified. */
  seeTransfer() {
    const { upload, doc } = this.store.state;
    if (upload?.what === "fence" && upload.state === "verified" && doc.zones !== null && doc.zones === this.sentZones) {
      this.heldFence();
    }
  }

  start() {
    return this.attempt(texts.start.hold, async () => {
      this.tell((await post("/api/start", { plan_id: this.store.state.plan?.id ?? "" })).text, false);
    });
  }

  resume() {
    return this.attempt(texts.drive.resume, async () => this.tell((await post("/api/resume")).text, false));
  }

  blocked() {
    return this.attempt(texts.drive.blocked, async () => this.tell((await post("/api/blocked", {})).text, false));
  }

  clearBlocked() {
    return this.attempt(texts.drive.clearBlocked, async () => this.tell((await post("/api/blocked/clear")).text, false));
  }

  takeControl() {
    return this.attempt(texts.top.control.take, async () => this.tell((await post("/api/control/take")).text, true));
  }

  giveControl() {
    this.hasGiven = true;
    return this.attempt(texts.top.control.give, async () => this.tell((await post("/api/control/give")).text, true));
  }

  /** @param {string} name */
  restore(name) {
    return this.attempt(texts.files.restore, async () => this.tell((await post("/api/backups/restore", { name })).text, false));
  }

  // Files

  /** @param {File} file */
  open(file) {
    this.opening = this.opening.then(() => this.openOne(file));
    return this.opening;
  }

  /** @param {File} file */
  openOne(file) {
    const name = shownName(file.name);
    if (file.size > MOST_BYTES) {
      this.tell(texts.refused(texts.files.open, texts.files.tooLarge(name, file.size)), true);
      return Promise.resolve(false);
    }
    return this.attempt(texts.files.openName(name), async () => {
      const found = await post(`/api/import?name=${encodeURIComponent(file.name)}`, file);
      const parts = openedParts(found, name);
      if (Object.keys(parts.doc).length > 0) {
        this.change(parts.step, parts.doc);
      }
      this.store.set({ opened: { name, remarks: found.remarks } });
      this.tell(texts.files.opened(name, parts.words.join(", ") || texts.files.empty), false);
    });
  }

  /**
   * @param {string} what
   * @param {string} format
   */
  save(what, format) {
    return this.attempt(texts.files.download, async () => {
      const { plan } = this.store.state;
      const zones = this.history.value.zones;
      const body = { what, format, ...(what === "plan" ? { plan_id: plan?.id ?? "" } : {}), ...(what === "fence" ? fenceBody(zones) : {}) };
      const { name, data } = await postForFile("/api/export", body);
      saveAs(name, data);
    });
  }

  /**
   * @param {string} what
   * @param {() => Promise<any>} act
   * @returns {Promise<boolean>} whether it was done
   */
  async attempt(what, act) {
    try {
      await act();
      return true;
    } catch (error) {
      const { message, advice } = refusal(error);
      this.tell(texts.refused(what, advice ? `${message} ${advice}` : message), true);
      return false;
    }
  }
}

/**
 * The waypoints of a shown route, without its start.
 * @param {import("./types.js").Plan | null} plan
 * @returns {Place[]}
 */
export function routePoints(plan) {
  return (plan?.points ?? []).slice(1).map((point) => point.at);
}

/**
 * What a file's parts change in the document.
 * @param {any} found
 * @param {string} name
 */
function openedParts(found, name) {
  /** @type {Partial<Doc>} */
  const doc = {};
  const words = [];
  let step = texts.steps.dropMission;
  if (found.fence && found.fence.held.features.length > 0) {
    doc.zones = zonesOf(found.fence);
    words.push(texts.files.parts.fence(doc.zones.length));
    step = texts.steps.dropFence;
  }
  if (found.points.length > 0) {
    doc.mission = { name, points: found.points, items: found.items.length > 0 ? found.items : null };
    words.unshift(texts.files.parts.mission(found.points.length));
    step = texts.steps.dropMission;
  }
  return { doc, words, step };
}

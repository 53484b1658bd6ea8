/** Asks for a plan whenever what is asked for changes; the newest question wins, and every question can be cancelled. */

import { RefusedError, post } from "./connection.js";
import { fenceBody, question, startBody } from "./doc.js";
import { texts } from "./texts.js";

/** @typedef {import("./types.js").PageState} PageState */

const PAUSE_MS = 60; // after a change, so that a drag asks some ten times a second at the most; chosen

export class Planner {
  /** @param {import("./store.js").Store<PageState>} store */
  constructor(store) {
    this.store = store;
    /** @type {AbortController | null} */
    this.running = null;
    this.timer = 0;
    /** @type {AbortController | null} */
    this.looking = null;
    /** @type {AbortController | null} */
    this.measuring = null;
    this.asked = "";
    this.askedFence = "";
    this.askedWidest = "";
  }

  /**
   * What is asked for has changed.
   * @param {boolean} [isAnew] also where the question is the same: what it rests on has changed
   */
  change(isAnew = false) {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.ask(isAnew), PAUSE_MS);
  }

  /** What a plan rests on has changed: it is not shown with its promise until it is made anew. */
  mistrust() {
    this.running?.abort();
    this.running = null;
    if (question(this.store.state.doc) !== null) {
      this.store.set({ plan: null, isPlanning: true });
    }
    this.change(true);
  }

  /**
   * A plan for this document is shown already: it is not asked for again.
   * @param {import("./types.js").Doc} doc
   */
  show(doc) {
    clearTimeout(this.timer);
    this.asked = JSON.stringify(question(doc));
  }

  /** Something else is asked of the server's planner now: what is running would only be in its way. */
  makeRoom() {
    clearTimeout(this.timer);
    this.running?.abort();
    this.running = null;
    this.store.set({ isPlanning: true });
  }

  /** Give up the question that is being answered. */
  cancel() {
    clearTimeout(this.timer);
    this.running?.abort();
    this.running = null;
    this.asked = "";
    // What was there before answers another question.
    this.store.set({ isPlanning: false, plan: null });
    post("/api/plan/cancel").catch(() => {});
  }

  /** @param {boolean} isAnew */
  async ask(isAnew) {
    const { doc } = this.store.state;
    this.look(isAnew);
    const asked = question(doc);
    const text = JSON.stringify(asked);
    if (text === this.asked && !isAnew) {
      return;
    }
    this.asked = text;
    this.running?.abort();
    this.running = null;
    if (!asked) {
      this.store.set({ plan: this.store.state.standing, isPlanning: false, planTrouble: null, widest_m: null });
      return;
    }
    const running = new AbortController();
    this.running = running;
    this.store.set({ isPlanning: true, planTrouble: null });
    try {
      const plan = await post(asked.path, asked.body, running.signal);
      if (this.running === running) {
        this.store.set({ plan, isPlanning: false, planTrouble: null });
        this.askWidest(isAnew);
      }
    } catch (error) {
      if (this.running === running) {
        this.store.set({ plan: null, isPlanning: false, planTrouble: refusal(error) });
      }
    }
  }

  /**
   * How wide it could be: the end of the slider. Asked only when the plan stands, so that it never waits for this.
   * @param {boolean} isAnew
   */
  async askWidest(isAnew) {
    const { doc } = this.store.state;
    const body = { targets: doc.targets, order: doc.order, comes_back: doc.comes_back, ...fenceBody(doc.zones), ...startBody(doc) };
    const text = JSON.stringify(body);
    const { plan } = this.store.state;
    // Where it is not the clearance that stands in the way, there is no widest route either.
    const isWorthIt = plan !== null && (plan.no_route === null || plan.no_route.widest !== null);
    if (doc.mission || doc.targets.length === 0 || !isWorthIt || (text === this.askedWidest && !isAnew)) {
      return;
    }
    this.askedWidest = text;
    this.measuring?.abort();
    this.measuring = new AbortController();
    this.store.set({ widest_m: null });
    try {
      const { clearance_m } = await post("/api/widest", body, this.measuring.signal);
      if (this.askedWidest === text) {
        this.store.set({ widest_m: clearance_m });
      }
    } catch {
      if (this.askedWidest === text) {
        this.askedWidest = "";
      }
    }
  }

  /**
   * Have a drawn fence looked at: what it comes to for this vehicle.
   * @param {boolean} isAnew
   */
  async look(isAnew) {
    const { doc } = this.store.state;
    const body = { ...fenceBody(doc.zones), ...(doc.clearance_m === null ? {} : { clearance_m: doc.clearance_m }) };
    const text = JSON.stringify(body);
    if (text === this.askedFence && !isAnew) {
      return;
    }
    this.askedFence = text;
    this.looking?.abort();
    const looking = new AbortController();
    this.looking = looking;
    if (doc.zones === null) {
      this.store.set({ looked: null });
      return;
    }
    try {
      const looked = await post("/api/fence/look", body, looking.signal);
      if (looking === this.looking) {
        this.store.set({ looked });
      }
    } catch (error) {
      const { fence } = this.store.state;
      if (looking === this.looking) {
        this.store.set({ looked: { ...fence, held: { type: "FeatureCollection", features: [] }, meant: null, trouble: refusal(error).message, where: "drawn", warnings: [] } });
      }
    }
  }
}

/**
 * What went wrong, in words.
 * @param {unknown} error
 * @returns {import("./connection.js").Refusal}
 */
export function refusal(error) {
  if (error instanceof RefusedError) {
    return error.refusal;
  }
  return { kind: "no_answer", message: texts.noAnswer, advice: "", details: {} };
}

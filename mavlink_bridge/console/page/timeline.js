/** A log's timeline: scrubbed, played at many speeds, with every decision where it fell. The server shows the moment that is asked for. */

import { fill, h, say, show, svg } from "./dom.js";
import { button, signButton } from "./panels/parts.js";
import { texts } from "./texts.js";

/** @typedef {import("./types.js").PageState} PageState */
/** @typedef {import("./types.js").Event} Event */

const SPEEDS = [1, 2, 5, 10, 30, 60];
const SEEK_MS = 100; // between moments that are asked for: as often as the server answers
const LATE_S = 0.01; // a decision at the moment itself is not "the next one"

/**
 * @param {import("./store.js").Store<PageState>} store
 * @param {(time_s: number) => void} seek
 */
export function timeline(store, seek) {
  const player = new Player(store, seek);
  const play = button(texts.replay.play, () => player.toggle(), { class: "main" });
  const speed = h("select", { "aria-label": texts.replay.speed, onchange: () => player.setSpeed(Number(speed.value)) }, SPEEDS.map((n) => h("option", { value: String(n) }, texts.replay.times(n))));
  const range = h("input", { type: "range", class: "scrub", "aria-label": texts.replay.at, step: "0.1", oninput: () => player.goTo(Number(range.value)) });
  const words = h("span", { class: "moment" });
  const marks = svg("svg", { class: "decisions", "aria-hidden": "true", preserveAspectRatio: "none", viewBox: "0 0 1000 12" });
  const step = (/** @type {1 | -1} */ way) => () => player.goToDecision(way);
  const element = h("section", { class: "timeline", "aria-label": texts.replay.title }, h("div", { class: "row" }, play, speed, signButton("before", texts.replay.previous, step(-1)), signButton("after", texts.replay.next, step(1)), words),
    h("div", { class: "scrub-box" }, marks, range));
  player.onchange = () => say(play, player.isPlaying ? texts.replay.pause : texts.replay.play);
  store.watch(["replay"], ({ replay }) => {
    show(element, replay !== null);
    if (replay) {
      range.min = String(replay.begin_s);
      range.max = String(replay.end_s);
      if (!player.isAhead()) {
        player.now_s = replay.now_s;
      }
      range.value = String(player.now_s);
      const text = replay.is_read ? texts.replay.position(player.now_s, replay.begin_s, replay.end_s) : texts.replay.reading;
      say(words, text);
      range.setAttribute("aria-valuetext", text);
    }
  });
  store.watch(["events", "replay"], ({ events, replay }) => fill(marks, replay ? decisions(events).map((event) => mark(event, replay)) : null));
  return element;
}

/**
 * What the director decided, without what the vehicle said.
 * @param {Event[]} events
 */
function decisions(events) {
  return events.filter((event) => event.name !== "statustext");
}

/**
 * @param {Event} event
 * @param {import("./types.js").Replay} replay
 */
function mark(event, { begin_s, end_s }) {
  const x = (1000 * (event.time_s - begin_s)) / Math.max(end_s - begin_s, 1e-6);
  return svg("line", { class: `decision ${event.severity}`, x1: x, x2: x, y1: 0, y2: 12 }, svg("title", {}, `${texts.clock(event.time_s)} ${event.text}`));
}

class Player {
  /**
   * @param {import("./store.js").Store<PageState>} store
   * @param {(time_s: number) => void} seek
   */
  constructor(store, seek) {
    this.store = store;
    this.seek = seek;
    this.now_s = 0;
    this.speed = 1;
    this.isPlaying = false;
    this.timer = 0;
    this.asked_ms = -Infinity;
    this.onchange = () => {};
  }

  toggle() {
    this.isPlaying = !this.isPlaying;
    const { replay } = this.store.state;
    if (this.isPlaying && replay && this.now_s >= replay.end_s) {
      this.now_s = replay.begin_s;
    }
    clearInterval(this.timer);
    if (this.isPlaying) {
      let before_ms = performance.now();
      this.timer = setInterval(() => {
        const now_ms = performance.now();
        this.ask(this.now_s + ((now_ms - before_ms) / 1000) * this.speed);
        before_ms = now_ms;
      }, SEEK_MS);
    }
    this.onchange();
  }

  /** @param {number} speed */
  setSpeed(speed) {
    this.speed = speed;
  }

  /** @param {number} time_s */
  goTo(time_s) {
    this.ask(time_s);
  }

  /** @param {1 | -1} way */
  goToDecision(way) {
    const times = decisions(this.store.state.events).map((event) => event.time_s).sort((a, b) => a - b);
    const next = way > 0 ? times.find((time_s) => time_s > this.now_s + LATE_S) : times.findLast((time_s) => time_s < this.now_s - LATE_S);
    if (next !== undefined) {
      this.ask(next);
    }
  }

  /** @param {number} time_s */
  ask(time_s) {
    const { replay } = this.store.state;
    if (!replay) {
      return;
    }
    this.now_s = Math.min(Math.max(time_s, replay.begin_s), replay.end_s);
    this.asked_ms = performance.now();
    this.seek(this.now_s);
    if (this.isPlaying && this.now_s >= replay.end_s) {
      this.toggle();
    }
  }

  /** Whether a moment was asked for just now: the server's answer to an older one is not gone back to. */
  isAhead() {
    return this.isPlaying || performance.now() - this.asked_ms < 2 * SEEK_MS;
  }
}

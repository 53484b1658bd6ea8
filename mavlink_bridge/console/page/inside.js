/**
 * What stands in the page's own file where it is a picture of a plan, a check or a log: there is no server then, nothing is live, and nothing
 * can be asked for. `one_file.py` makes such files.
 */

/**
 * @typedef {object} Held
 * @property {string[]} title
 * @property {any} message the snapshot, as the server would send it
 * @property {Moment[]} moments of a log, in time; empty where there is no log
 * @property {string[]} notes what was found
 * @property {import("./types.js").NamedLine[]} lines
 * @property {import("./types.js").NamedMark[]} marks
 *
 * A moment of a log: what is another one than at the moment before. `whole` are sections, `parts` some fields of a section.
 * @typedef {{time_s: number, whole: Record<string, any>, parts: Record<string, Record<string, any>>}} Moment
 */

/** @type {Held | null} */
export const INSIDE = read("inside");

/** Whether a server stands behind this page. */
export const isServed = INSIDE === null;

/** @param {string} id */
function read(id) {
  const text = document.getElementById(id)?.textContent;
  return text ? JSON.parse(text) : null;
}

/** Where the map's worker is, if it stands in this file. */
export function ownWorkerUrl() {
  const text = document.getElementById("map-worker")?.textContent;
  return text ? URL.createObjectURL(new Blob([text], { type: "text/javascript" })) : null;
}

/** Plays the server's part for the timeline: shows a log's moments out of the file. */
export class Shown {
  /**
   * @param {Held} held
   * @param {(message: any) => void} onmessage
   */
  constructor(held, onmessage) {
    this.held = held;
    this.onmessage = onmessage;
    onmessage(held.message);
    // A picture shows first what there is at its end: all of it.
    this.seek(held.message.state.replay?.end_s ?? 0);
  }

  /** @param {number} time_s */
  seek(time_s) {
    const { moments, message } = this.held;
    if (moments.length === 0) {
      return;
    }
    /** @type {Record<string, any>} */
    const state = { replay: { ...message.state.replay, now_s: time_s } };
    for (const { whole, parts } of moments.slice(0, Math.max(1, moments.findLastIndex((one) => one.time_s <= time_s) + 1))) {
      Object.assign(state, whole);
      for (const [name, fields] of Object.entries(parts)) {
        state[name] = { ...state[name], ...fields };
      }
    }
    this.onmessage({ type: "change", time_s, state });
  }
}

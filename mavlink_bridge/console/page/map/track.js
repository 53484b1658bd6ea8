/** The driven line, drawn cheaply however long it gets: what is old lies still in a source of its own, and only the newest part changes. */

import { metres } from "../geo.js";
import { line } from "./features.js";

/** @typedef {import("../geo.js").Place} Place */
/** @typedef {import("../types.js").TrackRow} TrackRow */

const TAIL = 240; // rows that change with each message; chosen: laid out anew in well below a millisecond
const EVEN_M = 0.05; // a row that moved the rover less than this is not drawn
const MOST = 40_000; // rows kept: with EVEN_M some kilometres at the least; older ones are thinned to every second one

/** How a mode's line looks: driven by a mission, held, or by a person or another mode. */
export class Track {
  /**
   * @param {import("./view.js").MapView | null} view
   * @param {(mode: number | null) => "auto" | "hold" | "other"} lookOf
   */
  constructor(view, lookOf) {
    this.view = view;
    this.lookOf = lookOf;
    /** @type {TrackRow[]} */
    this.rows = [];
    this.settled = 0; // rows that lie in the still source
    this.isDirty = false;
  }

  clear() {
    this.rows = [];
    this.settled = 0;
    this.isDirty = true;
    this.draw(true);
  }

  /**
   * Add rows, in the order of time.
   * @param {TrackRow[]} rows
   */
  add(rows) {
    for (const row of rows) {
      const last = this.rows.at(-1);
      if (!last || last[4] !== row[4] || moved_m(last, row) >= EVEN_M) {
        this.rows.push(row);
      }
    }
    if (this.rows.length > MOST) {
      this.rows = this.rows.filter((_, i) => i % 2 === 0 || i > MOST - TAIL);
      this.settled = 0;
    }
    this.isDirty = true;
  }

  /** Put what is new on the map: once a frame. @param {boolean} [isAll] */
  draw(isAll = false) {
    if (!this.isDirty || !this.view) {
      return;
    }
    this.isDirty = false;
    if (isAll || this.rows.length - this.settled > 2 * TAIL || this.settled > this.rows.length) {
      this.settled = Math.max(0, this.rows.length - TAIL);
      this.view.set("track-old", lines(this.rows.slice(0, this.settled + 1), this.lookOf));
    }
    this.view.set("track", lines(this.rows.slice(Math.max(0, this.settled - 1)), this.lookOf));
  }
}

/**
 * @param {TrackRow} a
 * @param {TrackRow} b
 */
function moved_m(a, b) {
  return Math.hypot(...metres([b[1], b[2]], [a[1], a[2]]));
}

/**
 * Lines of one look each; a line reaches to the first row of the next one.
 * @param {TrackRow[]} rows
 * @param {(mode: number | null) => string} lookOf
 */
export function lines(rows, lookOf) {
  /** @type {any[]} */
  const found = [];
  /** @type {Place[]} */
  let part = [];
  rows.forEach((row, i) => {
    part.push([row[1], row[2]]);
    const next = rows[i + 1];
    if (!next || lookOf(next[4]) !== lookOf(row[4])) {
      if (next) {
        part.push([next[1], next[2]]);
      }
      if (part.length > 1) {
        found.push(line(part, { look: lookOf(row[4]) }));
      }
      part = [];
    }
  });
  return found;
}

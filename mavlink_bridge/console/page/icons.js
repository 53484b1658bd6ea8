/** The buttons' small pictures: drawn here, so that no font has to have them. */

import { svg } from "./dom.js";

const PATHS = {
  fit: "M4 9V4h5M15 4h5v5M20 15v5h-5M9 20H4v-5",
  follow: "M12 3v4M12 17v4M3 12h4M17 12h4M12 8a4 4 0 1 0 0 8a4 4 0 1 0 0-8",
  undo: "M9 7L4 12l5 5M4 12h10a5 5 0 0 1 0 10h-3",
  redo: "M15 7l5 5l-5 5M20 12H10a5 5 0 0 0 0 10h3",
  save: "M12 3v12M7 10l5 5l5-5M4 20h16",
  legend: "M4 6h3M10 6h10M4 12h3M10 12h10M4 18h3M10 18h10",
  yes: "M4 13l5 5L20 6",
  no: "M5 5l14 14M19 5L5 19",
  up: "M12 20V5M6 11l6-6l6 6",
  down: "M12 4v15M6 13l6 6l6-6",
  plus: "M12 5v14M5 12h14",
  turn: "M4 8h14l-4-4M20 16H6l4 4",
  before: "M6 5v14M18 6l-7 6l7 6",
  after: "M18 5v14M6 6l7 6l-7 6",
  place: "M12 3v5M12 16v5M3 12h5M16 12h5M12 12h.01",
};

/** @typedef {keyof typeof PATHS} IconName */

/** @param {IconName} name */
export function icon(name) {
  return svg("svg", { class: "icon", viewBox: "0 0 24 24", "aria-hidden": "true" }, svg("path", { d: PATHS[name] }));
}

/** Clearance and speed along the route, with the rover's place in it. */

import { fill, h, letterScale, say, svg } from "./dom.js";
import { texts } from "./texts.js";

/** @typedef {import("./types.js").PageState} PageState */
/** @typedef {import("./types.js").ProfileSample} Sample */

const SCALE = letterScale(); // its numbers take so much room
const HEIGHT = 110 * SCALE;
const LEFT = 40 * SCALE;
const RIGHT = 40 * SCALE;
const TOP = 10 * SCALE;
const BOTTOM = 20 * SCALE;
const KEY_SHARES = { short: 1 / 100, long: 1 / 10 }; // of the route, that an arrow key goes on by; chosen
const MOST_CLEAR_M = 10; // more room than this is not told apart: what matters is near the fence

/** @param {import("./store.js").Store<PageState>} store */
export function profileChart(store) {
  const drawing = svg("svg", { class: "profile-drawing" });
  const words = h("p", { class: "quiet profile-words" });
  const marker = svg("line", { class: "profile-rover", y1: TOP, y2: HEIGHT - BOTTOM });
  const cursor = svg("line", { class: "profile-cursor", y1: TOP, y2: HEIGHT - BOTTOM });
  const element = h("figure", { class: "profile" }, h("figcaption", {}, h("span", {}, texts.profile.title), key()), drawing, words);
  let width = 600;
  /** @type {Sample[]} */
  let samples = [];
  const x = (/** @type {number} */ s_m) => LEFT + ((width - LEFT - RIGHT) * s_m) / Math.max(samples.at(-1)?.s_m ?? 1, 1e-6);
  const draw = () => {
    const { plan } = store.state;
    samples = plan?.profile ?? [];
    drawing.setAttribute("viewBox", `0 0 ${width} ${HEIGHT}`);
    describe(drawing, samples);
    fill(drawing, ...(samples.length > 1 ? chart(samples, plan?.asked_m ?? null, width, x) : []), cursor, marker);
    say(words, samples.length > 1 ? summary(samples) : texts.profile.none);
    drawing.classList.toggle("empty", samples.length < 2);
    place();
  };
  const place = () => {
    const { drive, hoverAlong_m } = store.state;
    setLine(marker, samples.length > 1 && drive.progress_m !== null ? x(Math.min(drive.progress_m, samples.at(-1)?.s_m ?? 0)) : null);
    setLine(cursor, samples.length > 1 && hoverAlong_m !== null ? x(hoverAlong_m) : null);
  };
  const point = (/** @type {Sample | null} */ sample) => {
    store.set({ hoverAlong_m: sample?.s_m ?? null });
    if (sample) {
      const text = texts.profile.here(sample.s_m, sample.clearance_m, sample.speed_mps);
      say(words, text);
      drawing.setAttribute("aria-valuenow", sample.s_m.toFixed(1));
      drawing.setAttribute("aria-valuetext", text);
    }
  };
  const leave = () => { store.set({ hoverAlong_m: null }); say(words, samples.length > 1 ? summary(samples) : texts.profile.none); };
  drawing.addEventListener("pointermove", (event) => {
    const along_m = ((event.offsetX / drawing.clientWidth) * width - LEFT) / (width - LEFT - RIGHT) * (samples.at(-1)?.s_m ?? 0);
    point(nearest(samples, along_m));
  });
  drawing.addEventListener("pointerleave", leave);
  drawing.addEventListener("blur", leave);
  drawing.addEventListener("keydown", (event) => {
    const step = (samples.at(-1)?.s_m ?? 0) * (event.shiftKey ? KEY_SHARES.long : KEY_SHARES.short);
    const at_m = store.state.hoverAlong_m ?? 0;
    const to_m = { ArrowLeft: at_m - step, ArrowDown: at_m - step, ArrowRight: at_m + step, ArrowUp: at_m + step, Home: 0, End: Infinity }[event.key];
    if (to_m !== undefined && samples.length > 1) {
      event.preventDefault();
      point(nearest(samples, Math.min(to_m, samples.at(-1)?.s_m ?? 0)));
    }
  });
  new ResizeObserver(() => {
    if (drawing.clientWidth > 0 && Math.abs(drawing.clientWidth - width) > 2) {
      width = drawing.clientWidth;
      draw();
    }
  }).observe(element);
  store.watch(["plan"], draw);
  store.watch(["drive", "hoverAlong_m"], place);
  return element;
}

/**
 * For who reads it with keys: a place along the route that arrows move, with its clearance and speed as its words.
 * @param {SVGElement} drawing
 * @param {Sample[]} samples
 */
function describe(drawing, samples) {
  const isThere = samples.length > 1;
  const found = isThere
    ? { role: "slider", tabindex: "0", "aria-label": texts.profile.keys, "aria-valuemin": "0", "aria-valuemax": samples[samples.length - 1].s_m.toFixed(1), "aria-valuenow": "0", "aria-valuetext": summary(samples) }
    : { role: "img", tabindex: null, "aria-label": texts.profile.none, "aria-valuemin": null, "aria-valuemax": null, "aria-valuenow": null, "aria-valuetext": null };
  for (const [name, value] of Object.entries(found)) {
    if (value === null) {
      drawing.removeAttribute(name);
    } else {
      drawing.setAttribute(name, value);
    }
  }
}

/** What the lines are. */
function key() {
  const sign = (/** @type {string} */ look) => svg("svg", { viewBox: "0 0 26 10", "aria-hidden": "true" }, look === "profile-clear" ? svg("rect", { class: look, x: 0, y: 1, width: 26, height: 8 }) : svg("line", { class: look, x1: 0, x2: 26, y1: 5, y2: 5 }));
  const names = [["profile-clear", texts.profile.clearance], ["profile-asked", texts.profile.asked], ["profile-speed", texts.profile.speed]];
  return h("span", { class: "profile-key" }, names.map(([look, name]) => h("span", {}, sign(look), name)));
}

/**
 * @param {SVGElement} line
 * @param {number | null} x
 */
function setLine(line, x) {
  line.setAttribute("visibility", x === null ? "hidden" : "visible");
  line.setAttribute("x1", String(x ?? 0));
  line.setAttribute("x2", String(x ?? 0));
}

/**
 * @param {Sample[]} samples
 * @param {number} along_m
 */
export function nearest(samples, along_m) {
  return samples.reduce((/** @type {Sample | null} */ best, one) => (best === null || Math.abs(one.s_m - along_m) < Math.abs(best.s_m - along_m) ? one : best), null);
}

/** @param {Sample[]} samples */
function summary(samples) {
  const least = samples.reduce((best, one) => ((one.clearance_m ?? Infinity) < (best.clearance_m ?? Infinity) ? one : best));
  return texts.profile.summary(least.clearance_m ?? NaN, least.s_m, Math.max(...samples.map((one) => one.speed_mps)));
}

/**
 * @param {Sample[]} samples
 * @param {number | null} asked_m
 * @param {number} width
 * @param {(s_m: number) => number} x
 */
function chart(samples, asked_m, width, x) {
  const clear = samples.map((one) => Math.min(one.clearance_m ?? MOST_CLEAR_M, MOST_CLEAR_M));
  const top_m = Math.max(1, Math.ceil(Math.max(...clear, asked_m ?? 0)));
  const top_mps = Math.max(1, Math.ceil(1.2 * Math.max(...samples.map((one) => one.speed_mps))));
  const y = (/** @type {number} */ value, /** @type {number} */ most) => HEIGHT - BOTTOM - ((HEIGHT - TOP - BOTTOM) * value) / most;
  const line = (/** @type {(one: Sample, i: number) => number} */ value, /** @type {number} */ most) => samples.map((one, i) => `${i ? "L" : "M"}${x(one.s_m).toFixed(1)} ${y(value(one, i), most).toFixed(1)}`).join("");
  const base = HEIGHT - BOTTOM;
  const end_m = samples.at(-1)?.s_m ?? 0;
  const area = `${line((_, i) => clear[i], top_m)}L${x(end_m)} ${base}L${x(0)} ${base}Z`;
  return [
    svg("path", { class: "profile-clear", d: area }),
    asked_m !== null && asked_m <= top_m && svg("line", { class: "profile-asked", x1: LEFT, x2: width - RIGHT, y1: y(asked_m, top_m), y2: y(asked_m, top_m) }),
    svg("path", { class: "profile-speed", d: line((one) => one.speed_mps, top_mps) }),
    svg("path", { class: "profile-axis", d: `M${LEFT} ${TOP}V${base}H${width - RIGHT}V${TOP}` }),
    label(LEFT - 4, TOP + 8 * SCALE, `${top_m} m`, "end"), label(LEFT - 4, base, "0", "end"), label(width - RIGHT + 4, TOP + 8 * SCALE, `${top_mps} m/s`, "start"), label(width - RIGHT + 4, base, "0", "start"),
    label(LEFT, HEIGHT - 5, "0 m", "start"), label(width - RIGHT, HEIGHT - 5, `${end_m.toFixed(0)} m`, "end"),
  ];
}

/**
 * @param {number} x
 * @param {number} y
 * @param {string} text
 * @param {string} anchor
 */
function label(x, y, text, anchor) {
  return svg("text", { x, y, "text-anchor": anchor, class: "profile-label" }, text);
}

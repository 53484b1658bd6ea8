/** The plan: what is asked for, and what comes of it. */

import { fill, h, keepFocus, say, show } from "../dom.js";
import { INSIDE, isServed } from "../inside.js";
import { texts } from "../texts.js";
import { legTable } from "./legs.js";
import { button, cannotWrite, foundPart, notes, placeField, pressButton, signButton } from "./parts.js";

/** @typedef {import("../types.js").PageState} PageState */
/** @typedef {import("../actions.js").Actions} Actions */
/** @typedef {import("../store.js").Store<PageState>} PageStore */

const CLICKS = [["target", texts.plan.clickSets], ["add", texts.plan.clickAdds], ["start", texts.plan.clickStart]];
const MOST_M = 20; // the slider's end while the widest clearance is not known

/**
 * @param {PageStore} store
 * @param {Actions} act
 */
export function planPanel(store, act) {
  if (!isServed) {
    return h("div", { class: "panel-body" }, INSIDE?.moments.length === 0 && foundPart(), resultPart(store, act), notesPart(store), legTable(store));
  }
  return h("div", { class: "panel-body" },
    resultPart(store, act), writePart(store, act), targetsPart(store, act), clearancePart(store, act), notesPart(store), pointsPart(store, act), legTable(store));
}

/**
 * @param {PageStore} store
 * @param {Actions} act
 */
function targetsPart(store, act) {
  const list = h("ol", { class: "places" });
  const none = h("p", { class: "quiet" }, texts.plan.noTargets);
  const tools = h("div", { class: "choice", role: "radiogroup", "aria-label": texts.plan.clicks }, h("span", { class: "quiet" }, texts.plan.clicks),
    CLICKS.map(([tool, words]) => h("label", { "data-tool": tool }, h("input", { type: "radio", name: "tool", value: tool, checked: tool === "target", onchange: () => store.set({ tool: /** @type {any} */ (tool) }) }),
      words)));
  const best = h("input", { type: "checkbox", onchange: () => act.change(texts.steps.order, { order: best.checked ? "best" : "given" }) });
  const back = h("input", { type: "checkbox", onchange: () => act.change(texts.steps.comesBack, { comes_back: back.checked }) });
  const bestLabel = h("label", {}, best, texts.plan.best);
  const backLabel = h("label", {}, back, texts.plan.comesBack);
  const fresh = placeField(texts.plan.newTarget, null, (place) => { act.addTarget(place); fresh.value = ""; });
  const clear = button(texts.plan.clear, () => act.clear(), { class: "quiet-button" });
  const startRow = h("div", { class: "row" });
  store.watch(["doc", "vehicle", "server"], ({ doc, vehicle, server }) => {
    const isOurs = server.source === "files" || (server.source === "log" && vehicle.position === null) || doc.start !== null;
    show(startRow, isOurs);
    show(/** @type {HTMLElement} */ (tools.querySelector('[data-tool="start"]')), isOurs);
    keepFocus(startRow, () => fill(startRow, h("span", {}, texts.plan.start), placeField(`${texts.plan.start}, ${texts.coordinates}`, doc.start, (place) => act.setStart(place)),
      doc.start && signButton("no", texts.plan.noStart, () => act.setStart(null)), !doc.start && !vehicle.position && h("p", { class: "quiet" }, texts.plan.startHint)));
  });
  store.watch(["doc", "tool"], ({ doc, tool }) => {
    const { targets } = doc;
    show(none, targets.length === 0);
    keepFocus(list, () => fill(list, targets.map((place, i) => h("li", {}, placeField(texts.plan.targetN(i + 1), place, (typed) => act.moveTarget(i, typed)),
      targets.length > 1 && signButton("up", texts.plan.up(i + 1), () => act.swapTargets(i, i - 1), { disabled: i === 0 }),
      targets.length > 1 && signButton("down", texts.plan.down(i + 1), () => act.swapTargets(i, i + 1), { disabled: i === targets.length - 1 }),
      signButton("no", texts.plan.remove(i + 1), () => act.removeTarget(i))))));
    best.checked = doc.order === "best";
    back.checked = doc.comes_back;
    show(bestLabel, targets.length > 1);
    show(backLabel, targets.length > 0);
    show(clear, targets.length > 0 || doc.mission !== null);
    for (const input of tools.querySelectorAll("input")) {
      input.checked = input.value === tool;
    }
  });
  return h("section", { "aria-label": texts.plan.targets }, h("div", { class: "row spread" }, h("h2", {}, texts.plan.targets), clear), startRow, none, list, h("div", { class: "row" }, fresh, button(texts.plan.add, () => fresh.dispatchEvent(new Event("change")))),
    tools, h("div", { class: "choice" }, bestLabel, backLabel));
}

/**
 * @param {PageStore} store
 * @param {Actions} act
 */
function clearancePart(store, act) {
  const slider = h("input", { type: "range", min: "0", max: String(MOST_M), step: "0.05", "aria-label": texts.plan.clearance });
  const number = h("input", { type: "number", min: "0", step: "0.05", "aria-label": `${texts.plan.clearance}, ${texts.plan.clearanceM}`, class: "short" });
  slider.addEventListener("input", () => act.setClearance(Number(slider.value), false));
  slider.addEventListener("change", () => act.setClearance(Number(slider.value)));
  number.addEventListener("change", () => act.setClearance(number.value === "" ? null : Math.max(0, Number(number.value))));
  const own = button("", () => act.setClearance(null), { class: "quiet-button" });
  const widest = button("", () => act.askWidest(), { class: "quiet-button" });
  store.watch(["doc", "widest_m", "plan", "fence"], ({ doc, widest_m, plan, fence }) => {
    const most = widest_m === null ? Math.max(MOST_M, doc.clearance_m ?? 0) : Math.max(widest_m, doc.clearance_m ?? 0, 0.1);
    slider.max = most.toFixed(2);
    const margin = fence.meant?.margin_m ?? null;
    const value = doc.clearance_m ?? (doc.widest ? plan?.promised_m ?? plan?.asked_m : margin) ?? 0;
    if (document.activeElement !== number) {
      number.value = value.toFixed(2);
    }
    slider.value = String(value);
    slider.setAttribute("aria-valuetext", texts.m(value));
    say(own, texts.plan.own(margin));
    say(widest, widest_m === null ? texts.plan.askWidest : texts.plan.widestPossible(widest_m));
    own.setAttribute("aria-pressed", String(doc.clearance_m === null && !doc.widest));
    widest.setAttribute("aria-pressed", String(doc.widest));
  });
  return h("section", { "aria-label": texts.plan.clearance }, h("h2", {}, texts.plan.clearance), h("div", { class: "row" }, slider, number, h("span", { "aria-hidden": "true" }, "m")), h("div", { class: "row" }, own, widest));
}

/**
 * @param {PageStore} store
 * @param {Actions} act
 */
function resultPart(store, act) {
  const working = h("span", { class: "working" }, texts.plan.working);
  const cancel = button(texts.cancel, () => act.planner.cancel());
  const busy = h("div", { class: "row busy" }, h("span", { class: "spinner", "aria-hidden": "true" }), working, cancel);
  const card = h("div", { class: "card" });
  const section = h("section", { "aria-label": texts.plan.title, "aria-live": "polite", id: "outcome" }, h("h2", {}, texts.plan.title), busy, card);
  store.watch(["isPlanning"], ({ isPlanning, doc }) => {
    show(busy, isPlanning);
    say(working, doc.mission ? texts.plan.checking : texts.plan.working);
  });
  store.watch(["plan", "planTrouble", "doc", "isPlanning"], (state) => keepFocus(card, () => {
    const { plan, planTrouble, isPlanning } = state;
    // What is shown while a newer question is being answered is no answer to it.
    show(card, true);
    card.className = `card ${planTrouble || plan?.no_route ? "bad" : isPlanning ? "" : look(plan)}`;
    if (planTrouble) {
      fill(card, h("strong", {}, texts.failed), h("p", {}, planTrouble.message), planTrouble.advice && h("p", {}, planTrouble.advice));
    } else if (isServed && plan?.no_route && hasNoStart(state)) {
      card.className = "card unsure";
      fill(card, h("strong", { class: "headline" }, texts.plan.needsStart), h("p", {}, texts.plan.needsStartWhy), button(texts.plan.askStart, () => store.set({ tool: "start" }), { class: "main" }));
    } else if (plan?.no_route) {
      fill(card, noRoute(plan.no_route, act));
    } else if (plan && plan.state !== "planning") {
      fill(card, outcome(plan, state, act));
    } else {
      show(card, !isPlanning || state.doc.targets.length === 0);
      const isEmpty = state.isPlanning || state.doc.targets.length === 0;
      fill(card, h("p", {}, isServed ? (isEmpty ? texts.plan.nothing : texts.plan.cancelled) : texts.plan.nothingHere),
        !isEmpty && button(texts.plan.again, () => act.planner.change(true)));
    }
  }));
  return section;
}

/** Whether nothing tells where a route would begin. @param {PageState} state */
function hasNoStart({ doc, vehicle, home, server }) {
  return server.source === "files" && doc.start === null && doc.mission === null && vehicle.position === null && home === null;
}

/** @param {import("../types.js").Plan | null} plan */
function look(plan) {
  if (!plan) {
    return "";
  }
  if (plan.legs.some((leg) => leg.verdict === "breaks") || plan.dangers.length > 0) {
    return "bad";
  }
  return plan.extrapolated.length > 0 ? "unsure" : "good";
}

/**
 * @param {import("../types.js").Plan} plan
 * @param {PageState} state
 * @param {Actions} act
 */
function outcome(plan, { doc }, act) {
  const broken = plan.legs.filter((leg) => leg.verdict === "breaks").length;
  const isBad = broken > 0 || plan.dangers.length > 0;
  const head = broken > 0 ? `✗ ${texts.plan.breaks(broken)}` : isBad ? `✗ ${plan.dangers[0]}` : headOf(plan);
  return [
    h("strong", { class: "headline" }, head),
    h("p", { class: "big" }, texts.plan.facts(plan.length_m, plan.duration_s, Math.max(0, plan.points.length - 1))),
    plan.narrowest && h("p", {}, texts.plan.narrowest(plan.narrowest.width_m)),
    h("p", {}, texts.plan.keeps({ drawn_m: plan.drawn_m, driven_m: plan.driven_m })),
    plan.start_m !== null && h("p", {}, texts.plan.startKeeps(plan.start_m)),
    h("p", { class: "quiet" }, doc.mission ? (doc.mission.name ? texts.plan.opened(doc.mission.name) : texts.plan.moved) : bySource(plan),
      plan.took_s !== null && ` (${texts.plan.took(plan.took_s)})`),
    doc.mission && h("div", { class: "row" }, button(texts.plan.backToPlanning, () => act.backToPlanning()), isBad && button(texts.plan.repair, () => act.repair(), { class: "main" })),
  ];
}

/** @param {import("../types.js").Plan} plan */
function bySource({ by, state }) {
  if (isServed) {
    return by === "director" ? texts.plan.byDirector : texts.plan.byPage;
  }
  return by === "director" ? texts.plan.byLog : state === "checked" ? texts.plan.byCheck : texts.plan.byPlan;
}

/** @param {import("../types.js").Plan} plan */
function headOf(plan) {
  if (plan.extrapolated.length > 0) {
    return `? ${texts.plan.predictedOnly}`;
  }
  if (plan.promised_m !== null) {
    return `✓ ${texts.plan.promised(plan.promised_m)}`;
  }
  return plan.is_promised ? `✓ ${texts.plan.holds}` : `– ${texts.plan.drawnOnly}`;
}

/**
 * @param {import("../types.js").NoRoute} why
 * @param {Actions} act
 */
function noRoute(why, act) {
  const { widest } = why;
  const metres = widest ? Math.floor(widest.clearance_m * 100 + 1e-6) / 100 : 0;
  return [
    h("strong", { class: "headline" }, `✗ ${texts.noRoute.title}`), h("p", {}, why.message), why.advice && h("p", {}, why.advice),
    // What only straight legs keep stands in the message, where it is room that is missing.
    widest && (widest.is_driven ? h("p", {}, texts.noRoute.widest(widest.clearance_m), widest.between.length > 0 && ` ${texts.noRoute.between(widest.between)}`) : h("p", {}, texts.noRoute.widestDrawn)),
    why.blockers.length > 0 && h("p", {}, `${texts.noRoute.blockers}: ${why.blockers.map((one) => one.name).join(", ")}`),
    isServed && widest && metres > 0 && (widest.is_driven ? button(texts.noRoute.take(metres), () => act.setClearance(metres), { class: "main" }) : button(texts.noRoute.takeWidest, () => act.askWidest(), { class: "main" })),
  ];
}

/**
 * @param {PageStore} store
 * @param {Actions} act
 */
function writePart(store, act) {
  const upload = button(texts.plan.upload, () => act.upload(), { class: "main", title: texts.plan.uploadHint });
  const start = pressButton(texts.start.hold, texts.start.holding, texts.start.name, () => act.start());
  const why = h("p", { class: "quiet" });
  const section = h("section", { "aria-label": texts.plan.upload }, h("div", { class: "row" }, upload, start), why);
  store.watch(["server", "control", "page", "isConnected", "plan", "standing", "drive", "isPlanning", "doc", "link"], (state) => {
    const { server, plan, isPlanning } = state;
    show(section, server.source === "live" || server.source === "demo");
    const reason = cannotWrite(state);
    upload.disabled = reason !== "" || isPlanning || !plan || plan.no_route !== null || plan.state === "planning" || (state.doc.mission !== null && !plan.is_promised);
    const waits = canStart(state);
    start.disabled = reason !== "" || !server.can.drive || !waits;
    say(why, reason || (!server.can.drive ? texts.start.noDrive : waits ? (server.can.arm ? texts.start.arms : texts.start.noArm) : state.doc.mission ? texts.start.byHand : state.drive.awaits_start ? texts.start.other : texts.start.noPlan));
  });
  return section;
}

/** @param {PageState} state */
export function canStart({ drive, plan }) {
  // Never what is on the vehicle while another route is shown.
  return drive.awaits_start && plan !== null && plan.id === drive.plan_id;
}

/** @param {PageStore} store */
function notesPart(store) {
  const element = h("section", { "aria-label": texts.plan.notes.info });
  store.watch(["plan"], ({ plan }) => {
    const { dangers, warnings, extrapolated, changed, info } = texts.plan.notes;
    const parts = plan ? [notes("dangers", plan.dangers, dangers), notes("extrapolated", plan.extrapolated, extrapolated), notes("warnings", plan.warnings, warnings),
      notes("changed", plan.changed, changed), notes("info", plan.info, info)] : [];
    fill(element, parts);
    show(element, parts.some(Boolean));
  });
  return element;
}

/**
 * The waypoints as fields, for who cannot drag them.
 * @param {PageStore} store
 * @param {Actions} act
 */
function pointsPart(store, act) {
  const list = h("ol", { class: "places" });
  const details = h("details", {}, h("summary", {}, texts.plan.points), list);
  store.watch(["plan", "doc"], ({ plan, doc }) => {
    const places = doc.mission?.points ?? (plan?.points ?? []).slice(1).map((point) => point.at);
    show(details, places.length > 0 && places.length <= 200);
    keepFocus(list, () => fill(list, places.length <= 200 ? places.map((place, i) => h("li", {}, placeField(texts.plan.pointN(i + 1), place, (typed) => act.movePoint(i, typed)))) : []));
  });
  return details;
}

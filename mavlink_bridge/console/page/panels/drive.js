/** The drive: where the rover is on its route, how near it came, and what may be done about it. */

import { h, say, show } from "../dom.js";
import { isServed } from "../inside.js";
import { texts } from "../texts.js";
import { comparison } from "./after.js";
import { button, cannotWrite, facts, foundPart, pressButton } from "./parts.js";

/** @typedef {import("../types.js").PageState} PageState */

/**
 * @param {import("../store.js").Store<PageState>} store
 * @param {import("../actions.js").Actions} act
 */
export function drivePanel(store, act) {
  return h("div", { class: "panel-body" }, foundPart(), progressPart(store), isServed && [deedsPart(store, act), comparison(store)]);
}

/** @param {import("../store.js").Store<PageState>} store */
function progressPart(store) {
  const names = texts.drive;
  const bar = h("progress", { max: "1", value: "0", "aria-label": names.progress });
  const list = facts([["state", names.state], ["progress", names.progress], ["eta", names.eta], ["deviation", names.deviation], ["least", names.least], ["asked", names.asked], ["next", names.next], ["home", names.wayHome]]);
  const trouble = h("p", { class: "card bad", role: "alert" });
  store.watch(["drive"], ({ drive }) => {
    const { progress_m, length_m } = drive;
    const isKnown = progress_m !== null && length_m !== null;
    list.set("state", drive.state_text || drive.state);
    list.set("progress", isKnown ? texts.drive.along(progress_m, length_m) : texts.top.unknown);
    list.set("eta", texts.duration(drive.is_driving ? drive.eta_s : null));
    list.set("next", drive.next_seq === null ? texts.top.unknown : String(drive.next_seq));
    list.set("home", drive.way_home || texts.top.unknown);
    bar.value = isKnown && length_m > 0 ? progress_m / length_m : 0;
    showKept(list, drive);
    say(trouble, drive.trouble);
    show(trouble, drive.trouble !== "");
  });
  return h("section", { "aria-label": names.title }, h("h2", {}, names.title), trouble, bar, list.element);
}

/**
 * How near to the fence, and how far off the line.
 * @param {ReturnType<typeof facts>} list
 * @param {import("../types.js").Drive} drive
 */
function showKept(list, drive) {
  const { unknown } = texts.top;
  const { deviation_m, least_clearance_m, asked_m, breaches } = drive;
  list.set("deviation", deviation_m === null ? unknown : texts.drive.off(deviation_m, drive.corridor_ok), drive.corridor_ok ? "" : "alarm");
  const isBroken = breaches > 0 || (asked_m !== null && least_clearance_m !== null && least_clearance_m < asked_m);
  const least = least_clearance_m === null ? unknown : texts.m(least_clearance_m);
  list.set("least", breaches > 0 ? `${least}, ${texts.drive.breaches(breaches)}` : least, isBroken ? "alarm" : "");
  list.set("asked", asked_m === null ? unknown : texts.m(asked_m));
}

/**
 * @param {import("../store.js").Store<PageState>} store
 * @param {import("../actions.js").Actions} act
 */
function deedsPart(store, act) {
  const resume = pressButton(texts.drive.resume, texts.start.holding, texts.drive.resumeName, () => act.resume());
  const blocked = button(texts.drive.blocked, () => act.blocked());
  const forget = button(texts.drive.clearBlocked, () => act.clearBlocked());
  const why = h("p", { class: "quiet" });
  const section = h("section", { "aria-label": texts.drive.blocked }, h("div", { class: "row" }, resume, blocked, forget), h("p", { class: "quiet" }, texts.drive.blockedHint), why);
  store.watch(["server", "control", "page", "isConnected", "drive", "fence"], (state) => {
    const { server, drive, fence } = state;
    show(section, server.source === "live" || server.source === "demo");
    const reason = cannotWrite(state);
    resume.disabled = reason !== "" || !drive.can_resume || drive.state === "arrived";
    blocked.disabled = reason !== "" || !server.can.drive;
    forget.disabled = reason !== "" || fence.obstacles.length === 0;
    say(why, reason);
  });
  return section;
}


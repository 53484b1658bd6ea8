/** What stands on every page: the state of the vehicle, alarms, who holds control, and HOLD. */

import { fill, h, say, show } from "./dom.js";
import { button, confirmed } from "./panels/parts.js";
import { texts } from "./texts.js";

/** @typedef {import("./types.js").PageState} PageState */
/** @typedef {import("./actions.js").Actions} Actions */
/** @typedef {import("./store.js").Store<PageState>} PageStore */

/**
 * How old the newest heartbeat is by now; null where none is known.
 * @param {PageState} state
 */
export function heartbeatAge_s({ link, clock_s, replay }) {
  return link.heard_s === null ? null : Math.max(0, (replay ? replay.now_s : clock_s) - link.heard_s);
}

/** @param {PageStore} store */
export function vehicleBar(store) {
  const words = texts.top;
  const chips = Object.fromEntries(["link", "mode", "armed", "fix", "battery", "speed"].map((name) => [name, h("span", { class: "chip-value" })]));
  const chip = (/** @type {string} */ name, /** @type {string} */ title) => h("li", { class: `chip chip-${name}` }, h("span", { class: "chip-name" }, title), chips[name]);
  const bar = h("ul", { class: "chips", "aria-label": words.state },
    chip("link", words.link), chip("mode", words.mode), chip("armed", words.armed), chip("fix", words.fix), chip("battery", words.battery), chip("speed", words.speed));
  store.watch(["vehicle"], ({ vehicle }) => {
    say(chips.mode, vehicle.mode_text || words.unknown);
    say(chips.armed, vehicle.armed === null ? words.armedUnknown : vehicle.armed ? `● ${words.armed}` : `○ ${words.disarmed}`);
    chips.armed.className = `chip-value ${vehicle.armed ? "armed" : ""}`;
    const satellites = vehicle.satellites === null ? "" : `, ${words.satellites(vehicle.satellites)}`;
    say(chips.fix, vehicle.fix_text ? `${vehicle.fix_text}${satellites}${vehicle.fix_error_m === null ? "" : ` ±${vehicle.fix_error_m.toFixed(2)} m`}` : words.unknown);
    const volts = vehicle.battery_v === null ? "" : `${vehicle.battery_v.toFixed(1)} V`;
    say(chips.battery, vehicle.battery_percent === null ? volts || words.unknown : `${vehicle.battery_percent} % ${volts}`);
    chips.battery.className = `chip-value ${vehicle.battery_percent !== null && vehicle.battery_percent <= 20 ? "alarm" : ""}`;
    say(chips.speed, vehicle.speed_mps === null ? words.unknown : `${vehicle.speed_mps.toFixed(1)} m/s`);
  });
  store.watch(["link", "clock_s", "replay", "isConnected"], (state) => {
    const { link, isConnected } = state;
    const age_s = heartbeatAge_s(state);
    const missed = link.heartbeats_missed_percent ? `, ${words.missed(link.heartbeats_missed_percent)}` : "";
    say(chips.link, !isConnected ? words.notKnown : `${words.links[link.state] ?? link.state}${age_s === null || link.state === "none" ? "" : `, ${words.heartbeat(age_s)}`}${missed}`);
    chips.link.className = `chip-value ${!isConnected || link.state === "lost" || link.state === "closed" ? "alarm" : link.state === "late" ? "warn" : ""}`;
  });
  store.watch(["server"], ({ server }) => show(bar, server.source !== "files"));
  return bar;
}

/**
 * @param {PageStore} store
 * @param {Actions} act
 */
export function controlBar(store, act) {
  const who = h("span", { class: "who" });
  const take = button(texts.top.control.take, async () => {
    const { control } = store.state;
    if (!control.holder || control.is_away || await confirmed(texts.top.control.confirm(control.holder), texts.top.control.take)) {
      await act.takeControl();
    }
  });
  const give = button(texts.top.control.give, () => act.giveControl(), { class: "quiet-button" });
  const bar = h("div", { class: "control" }, who, take, give);
  store.watch(["control", "page", "server"], ({ control, page, server }) => {
    const isMine = control.holder !== null && control.holder === page;
    const words = texts.top.control;
    const holder = isMine ? words.yours : control.holder ? words.other(control.holder) + (control.is_away ? words.away : "") : words.free;
    say(who, server.can.upload ? holder : texts.top.onlyLook.upload);
    who.title = page ? texts.top.you(page) : "";
    show(take, server.can.upload && !isMine);
    show(give, server.can.upload && isMine);
    show(bar, server.source === "live" || server.source === "demo");
  });
  return bar;
}

/**
 * What must not be overlooked on any page, whichever of its parts is open.
 * @param {PageStore} store
 */
export function alarms(store) {
  return [linkAlarm(store), vehicleAlarm(store)];
}

/** @param {PageStore} store */
function vehicleAlarm(store) {
  const bar = h("div", { class: "vehicle-alarm", role: "alert" });
  store.watch(["drive", "isConnected"], ({ drive, isConnected }) => {
    const words = texts.alarm;
    const said = [drive.breaches > 0 && words.breach(drive.breaches), drive.is_left_armed && words.leftArmed].filter(Boolean);
    say(bar, isConnected ? said.join(" ") : "");
    bar.classList.toggle("late", drive.breaches === 0);
    show(bar, bar.textContent !== "");
  });
  return bar;
}

/** @param {PageStore} store */
function linkAlarm(store) {
  const bar = h("div", { class: "alarm-bar", role: "alert" });
  const main = h("span", {});
  // The age changes all the time: it is shown beside the alarm, and read out only once.
  const age = h("span", { "aria-hidden": "true" });
  fill(bar, main, age);
  store.watch(["isConnected", "link", "clock_s"], (state) => {
    const { isConnected, link } = state;
    const age_s = heartbeatAge_s(state) ?? 0;
    const words = texts.alarm;
    const text = !isConnected ? words.page : link.state === "lost" ? words.lost : link.state === "closed" ? words.closed(link.trouble) : link.state === "late" ? words.late : "";
    say(main, text);
    say(age, isConnected && (link.state === "lost" || link.state === "late") ? ` ${words.since(texts.age(age_s))}` : "");
    bar.className = `alarm-bar ${link.state === "late" && isConnected ? "late" : ""}`;
    show(bar, text !== "");
    document.documentElement.classList.toggle("is-lost", !isConnected || link.state === "lost" || link.state === "closed");
  });
  return bar;
}

/**
 * HOLD, or why there is none; the vehicle's answer stands beside it.
 * @param {PageStore} store
 * @param {Actions} act
 */
export function holdBar(store, act) {
  const answer = h("p", { class: "hold-answer", role: "status" });
  const key = h("small", {}, texts.hold.key);
  const stop = h("button", { type: "button", id: "hold", class: "hold", "aria-label": texts.hold.name, "aria-keyshortcuts": "H", onclick: () => act.hold() }, h("span", {}, texts.hold.button), " ", key);
  const missing = h("p", { class: "hold-missing" });
  const bar = h("section", { class: "hold-bar", id: "hold-bar", "aria-label": texts.hold.button }, answer, missing, stop);
  store.watch(["server"], ({ server }) => {
    const isLive = server.source === "live" || server.source === "demo";
    show(stop, isLive && server.can.drive);
    show(missing, !isLive || !server.can.drive);
    say(missing, isLive ? texts.hold.missing : texts.hold.noVehicle);
  });
  store.watch(["hold", "holdSent"], ({ hold, holdSent }) => {
    say(answer, holdSent || hold.text || texts.hold.states[hold.state]);
    answer.className = `hold-answer ${hold.state === "no_answer" || holdSent.startsWith(texts.hold.failed("").slice(0, 8)) ? "alarm" : hold.state}`;
    show(answer, answer.textContent !== "");
  });
  document.addEventListener("keydown", (event) => {
    if ((event.key === "h" || event.key === "H") && !event.ctrlKey && !event.metaKey && !event.repeat && !typesText(event.target) && !stop.hidden) {
      event.preventDefault();
      act.hold();
    }
  });
  return bar;
}

/** @param {EventTarget | null} target a field in which the letter is wanted */
export function typesText(target) {
  return target instanceof HTMLTextAreaElement || (target instanceof HTMLInputElement && target.type === "text");
}

/** The page: its parts made and tied together. */

import { Actions } from "./actions.js";
import { Live, beginSession, meant } from "./connection.js";
import { EMPTY, question } from "./doc.js";
import { fill, h } from "./dom.js";
import { acceptDrops } from "./dropping.js";
import { INSIDE, Shown, isServed } from "./inside.js";
import { take, unknown } from "./live.js";
import { Scene } from "./map/scene.js";
import { Pointing } from "./map/pointing.js";
import { prepareTiles } from "./map/tiles.js";
import { MapView, hasWebGl } from "./map/view.js";
import { toolbar } from "./map/toolbar.js";
import { plainPicture } from "./map/plain.js";
import { drivePanel } from "./panels/drive.js";
import { eventsPanel } from "./panels/events.js";
import { fencePanel } from "./panels/fence.js";
import { filesPanel } from "./panels/files.js";
import { planPanel } from "./panels/plan.js";
import { transferNote } from "./panels/transfer.js";
import { Planner } from "./planner.js";
import { profileChart } from "./profile.js";
import { Store } from "./store.js";
import { tabs } from "./tabs.js";
import { texts } from "./texts.js";
import { timeline } from "./timeline.js";
import { toasts } from "./toasts.js";
import { alarms, controlBar, holdBar, typesText, vehicleBar } from "./top.js";

/** @typedef {import("./types.js").PageState} PageState */

const CLOCK_MS = 200; // between looks at how old the newest heartbeat is

const store = new Store(unknown());
const planner = new Planner(store);
const { element: toastList, tell } = toasts();
const actions = new Actions(store, planner, tell);

/** @type {Scene | null} */
let scene = null;
/** @type {MapView | null} */
let view = null;
/** Rows of the track that came before the map could draw. @type {import("./types.js").TrackRow[]} */
let early = [];

const track = {
  clear: () => { early = []; scene?.track.clear(); },
  add: (/** @type {import("./types.js").TrackRow[]} */ rows) => (scene ? scene.track.add(rows) : early.push(...rows)),
};

const mapArea = h("section", { class: "map-area", id: "map", "aria-label": texts.map.area });

/** @param {PageState} state */
async function buildMap(state) {
  if (!hasWebGl()) {
    fill(mapArea, isServed ? plainPicture(store) : h("p", { class: "no-webgl card unsure" }, texts.map.noWebGlHere));
    return;
  }
  const box = h("div", { class: "map" });
  fill(mapArea, box);
  await prepareTiles(state.server.map);
  view = new MapView(box, state.server.map);
  scene = new Scene(view, store);
  scene.track.add(early);
  early = [];
  if (!isServed) {
    scene.showAll();
  }
  const pointing = new Pointing(view, store, actions);
  mapArea.append(toolbar(store, actions, scene, view, pointing));
  requestAnimationFrame(drawTrack);
}

function drawTrack() {
  scene?.track.draw();
  requestAnimationFrame(drawTrack);
}

function buildPage() {
  // In one column the map may have been scrolled away from under who wants to draw on it.
  store.watch(["tool"], ({ tool }) => ["polygon", "circle", "start"].includes(tool) && mapArea.scrollIntoView({ block: "nearest" }));
  const source = h("p", { class: "source" });
  store.watch(["server"], ({ server }) => { fill(source, texts.top.source(server.source, server.source_name)); });
  document.documentElement.lang = texts.language;
  fill(document.body,
    h("a", { class: "jump", href: "#hold-bar" }, texts.skipHold), h("a", { class: "jump", href: "#panel" }, texts.skip),
    h("header", { class: "top" }, h("div", { class: "brand" }, h("h1", {}, texts.name), source), vehicleBar(store), controlBar(store, actions)),
    alarms(store),
    h("main", {}, mapArea, h("div", { class: "side", id: "panel" }, transferNote(store), panels()), timeline(store, seek), profileChart(store), holdBar(store, actions)),
    toastList);
}

/**
 * A page that is one file: nothing in it is live, so there is no HOLD and nothing to ask for.
 * @param {import("./inside.js").Held} held
 */
function buildStill(held) {
  document.documentElement.lang = texts.language;
  fill(document.body,
    h("a", { class: "jump", href: "#panel" }, texts.skip),
    h("header", { class: "top" }, h("div", { class: "brand" }, h("h1", {}, texts.name), held.title.map((line) => h("p", { class: "source" }, line)), h("p", { class: "source" }, texts.top.still)), vehicleBar(store)),
    h("main", {}, mapArea, h("div", { class: "side", id: "panel" }, panels()), timeline(store, (time_s) => shown?.seek(time_s)), profileChart(store)));
}

/** The parts of the side: in a page that is one file those that only show. */
function panels() {
  /** @type {Parameters<typeof tabs>[1]} */
  const all = [
    ["plan", planPanel(store, actions)], ["drive", drivePanel(store, actions)], ["fence", fencePanel(store, actions)],
    ["files", filesPanel(store, actions)], ["events", eventsPanel(store, (place) => view?.show(place))],
  ];
  /** @type {string[]} */
  const still = INSIDE && INSIDE.moments.length > 0 ? ["drive", "plan", "fence", "events"] : ["plan", "fence"];
  return tabs(store, isServed ? all : still.flatMap((name) => all.filter(([one]) => one === name)));
}

/** Who loses control is told, and why: by another page, or because this one was gone for too long. */
function watchControl() {
  let isMine = false;
  store.watch(["control", "page", "isConnected"], ({ control, page, isConnected }) => {
    if (!isConnected) {
      return; // what is known is old
    }
    const words = texts.top.control;
    const isStill = control.holder !== null && control.holder === page;
    if (isMine && !isStill && !actions.hasGiven) {
      tell(control.holder ? words.taken(control.holder) : words.lost, true);
    }
    actions.hasGiven &&= isStill;
    isMine = isStill;
  });
}

/** Keys that act everywhere but in a text. @param {KeyboardEvent} event */
function press(event) {
  if ((event.ctrlKey || event.metaKey) && event.key.toLowerCase() === "z" && !typesText(event.target)) {
    event.preventDefault();
    if (event.shiftKey) {
      actions.redo();
    } else {
      actions.undo();
    }
  } else if ((event.ctrlKey || event.metaKey) && event.key.toLowerCase() === "y" && !typesText(event.target)) {
    event.preventDefault();
    actions.redo();
  } else if (event.key === "Escape" && ["polygon", "circle"].includes(store.state.tool)) {
    store.set({ tool: "none" });
  }
}

/** The server's clock goes on between its messages. */
let ahead_s = 0;

/** @param {any} message */
function hear(message) {
  const before = store.state;
  ahead_s = message.time_s - performance.now() / 1000;
  take(store, message, track);
  const { server, fence } = store.state;
  Object.assign(meant, { run_id: server.run_id, ahead_s });
  if (message.type === "snapshot") {
    begin(before, store.state);
  }
  if (before.fence.id !== fence.id || (message.type === "snapshot" && before.server.run_id !== server.run_id)) {
    // What was planned rests on another fence now.
    planner.mistrust();
  }
  if ("plan" in (message.state ?? {})) {
    showStanding();
  }
}

/** The moment of a log that was asked for last. @type {number | null} */
let moment_s = null;

/** @param {number} time_s */
function seek(time_s) {
  moment_s = time_s;
  live?.send({ type: "seek", time_s });
}

/**
 * The first snapshot, or that of a server started anew.
 * @param {PageState} before
 * @param {PageState} state
 */
function begin(before, state) {
  if (mapArea.childElementCount === 0) {
    buildMap(state);
  } else if (before.server.run_id && before.server.run_id !== state.server.run_id) {
    tell(texts.alarm.restarted, false);
  }
  if (state.replay && moment_s !== null) {
    // A new connection begins at the log's begin.
    seek(moment_s);
  }
  showStanding();
}

/** Without a question of this page the director's plan is shown; and the plan that a page's own became, once it stands. */
function showStanding() {
  const { doc, standing } = store.state;
  if (question(doc) === null || (standing && isSame(standing.request, doc) && standing.state !== "planning")) {
    store.set({ plan: standing });
  }
}

/**
 * @param {import("./types.js").Asked} request
 * @param {import("./types.js").Doc} doc
 */
function isSame(request, doc) {
  const asked = (/** @type {any} */ one) => JSON.stringify([one.targets, one.clearance_m, one.widest, one.order, one.comes_back]);
  return doc.mission === null && doc.zones === null && asked(request) === asked(doc);
}

/** @type {Live | null} */
let live = null;
/** @type {Shown | null} */
let shown = null;

async function run() {
  if (INSIDE) {
    buildStill(INSIDE);
    store.set({ doc: EMPTY, lines: INSIDE.lines, marks: INSIDE.marks, tool: "none" });
    shown = new Shown(INSIDE, hear);
    return;
  }
  buildPage();
  watchControl();
  document.addEventListener("keydown", press);
  window.addEventListener("beforeunload", (event) => {
    // The browser asks before it drops a fence that stands nowhere else.
    if (store.state.doc.zones !== null || store.state.drawn.length > 0) {
      event.preventDefault();
    }
  });
  acceptDrops((file) => actions.open(file));
  store.set({ doc: EMPTY });
  setInterval(() => store.set({ clock_s: performance.now() / 1000 + ahead_s }), CLOCK_MS);
  try {
    await beginSession();
  } catch {
    tell(texts.badToken, true);
  }
  live = new Live(hear, (isConnected) => store.set({ isConnected }));
}

run();


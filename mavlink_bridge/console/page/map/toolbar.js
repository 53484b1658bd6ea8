/** The tools on the map. */

import { h, saveAs, svg } from "../dom.js";
import { INSIDE, isServed } from "../inside.js";
import { signButton } from "../panels/parts.js";
import { texts } from "../texts.js";

/**
 * @param {import("../store.js").Store<import("../types.js").PageState>} store
 * @param {import("../actions.js").Actions} act
 * @param {import("./scene.js").Scene} scene
 * @param {import("./view.js").MapView} view
 * @param {import("./pointing.js").Pointing} pointing
 */
export function toolbar(store, act, scene, view, pointing) {
  const words = texts.tools;
  const hasRover = INSIDE === null || INSIDE.moments.length > 0;
  const follow = signButton("follow", words.follow, () => {
    scene.isFollowing = !scene.isFollowing;
    follow.setAttribute("aria-pressed", String(scene.isFollowing));
    scene.showRover(store.state);
  }, { "aria-pressed": "false" });
  view.map.on("dragstart", () => {
    scene.isFollowing = false;
    follow.setAttribute("aria-pressed", "false");
  });
  const legend = legendBox();
  const legendButton = signButton("legend", words.legend, () => {
    legend.hidden = !legend.hidden;
    legendButton.setAttribute("aria-expanded", String(!legend.hidden));
  }, { "aria-expanded": "false" });
  const undo = signButton("undo", `${words.undo} (Ctrl+Z)`, () => act.undo());
  const redo = signButton("redo", `${words.redo} (Ctrl+Y)`, () => act.redo());
  store.watch(["doc", "drawn"], ({ drawn }) => {
    undo.disabled = act.history.past.length === 0 && drawn.length === 0;
    redo.disabled = act.history.future.length === 0;
  });
  const finish = signButton("yes", words.finish, () => pointing.close());
  const stop = signButton("no", words.stop, () => pointing.giveUp());
  store.watch(["tool"], ({ tool }) => {
    finish.hidden = tool !== "polygon";
    stop.hidden = tool !== "polygon" && tool !== "circle";
  });
  return h("div", { class: "map-tools", role: "group", "aria-label": words.name }, signButton("fit", words.fit, () => scene.fit()), hasRover && follow, isServed && [undo, redo, finish, stop],
    signButton("save", words.picture, async () => { saveAs("pbpp.png", /** @type {Blob} */ (await view.picture())); }), legendButton, legend);
}

function legendBox() {
  const rows = texts.map.legendRows.map(([look, words]) => h("li", {}, svg("svg", { class: `legend-sign ${look}`, viewBox: "0 0 36 14", "aria-hidden": "true" },
    svg("rect", { class: "area", x: 1, y: 1, width: 34, height: 12 }), svg("line", { x1: 2, x2: 34, y1: 7, y2: 7 })), words));
  return h("div", { class: "legend", hidden: true }, h("h2", {}, texts.map.legend), h("ul", {}, rows));
}

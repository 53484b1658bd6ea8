/** Without WebGL: the server's picture, to look at only. */

import { fill, h } from "../dom.js";
import { texts } from "../texts.js";

const AGAIN_MS = 2000; // a moving rover is seen so often; chosen

/** @param {import("../store.js").Store<import("../types.js").PageState>} store */
export function plainPicture(store) {
  const image = h("img", { alt: texts.map.pictureName, class: "plain-picture" });
  const element = h("div", { class: "no-webgl" });
  fill(element, h("p", { class: "card unsure" }, texts.map.noWebGl), image);
  let asked_ms = -Infinity;
  store.watch(["plan", "fence", "vehicle"], () => {
    if (performance.now() - asked_ms > AGAIN_MS) {
      asked_ms = performance.now();
      image.src = `/api/picture.svg?t=${Math.round(asked_ms)}`;
    }
  });
  return element;
}

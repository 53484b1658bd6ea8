/** Without WebGL: the server's picture, to look at only. */

import { fill, h, show } from "../dom.js";
import { texts } from "../texts.js";

const AGAIN_MS = 2000; // a moving rover is seen so often; chosen

/** @param {import("../store.js").Store<import("../types.js").PageState>} store */
export function plainPicture(store) {
  const image = h("img", { alt: texts.map.pictureName, class: "plain-picture" });
  const element = h("div", { class: "no-webgl", tabindex: "0", role: "group", "aria-label": texts.map.pictureName });
  fill(element, h("p", { class: "card unsure" }, texts.map.noWebGl), image);
  let timer = 0;
  let asked_ms = -Infinity;
  const ask = () => {
    timer = 0;
    asked_ms = performance.now();
    image.src = `/api/picture.svg?t=${Math.round(asked_ms)}`;
  };
  store.watch(["plan", "fence", "vehicle"], ({ plan }) => {
    // The server draws the newest plan: before the first one there is nothing to ask for.
    if (plan && plan.no_route === null && !timer) {
      timer = setTimeout(ask, Math.max(0, asked_ms + AGAIN_MS - performance.now()));
    }
    show(image, plan !== null && plan.no_route === null);
  });
  return element;
}

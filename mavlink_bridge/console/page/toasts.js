/** Short answers to what was done: read out, and gone after a while; troubles stay until they are closed. */

import { h } from "./dom.js";
import { signButton } from "./panels/parts.js";
import { texts } from "./texts.js";

const SHOWN_MS = 6000;
const MOST = 3;

export function toasts() {
  const calm = h("div", { role: "status" });
  const troubles = h("div", { role: "alert" });
  const element = h("div", { class: "toasts" }, troubles, calm);
  const tell = (/** @type {string} */ text, /** @type {boolean} */ isTrouble) => {
    if (!text) {
      return;
    }
    const toast = h("div", { class: `toast ${isTrouble ? "bad" : ""}` }, h("span", { class: "grow" }, text), signButton("no", texts.close, () => toast.remove()));
    const list = isTrouble ? troubles : calm;
    list.append(toast);
    while (list.childElementCount > MOST) {
      list.firstElementChild?.remove();
    }
    if (!isTrouble) {
      setTimeout(() => toast.remove(), SHOWN_MS);
    }
  };
  return { element, tell };
}

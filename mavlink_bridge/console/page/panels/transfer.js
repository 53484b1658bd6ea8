/** What is being written to the vehicle, or was, above whatever panel is open. */

import { fill, h, show } from "../dom.js";
import { texts } from "../texts.js";

const SHOWN_MS = 15_000; // a verified upload is told for so long; a failed one stays

/** @param {import("../store.js").Store<import("../types.js").PageState>} store */
export function transferNote(store) {
  const element = h("div", { class: "card transfer", role: "status" });
  let timer = 0;
  store.watch(["upload"], ({ upload }) => {
    clearTimeout(timer);
    show(element, upload !== null);
    if (!upload) {
      return;
    }
    if (upload.state === "verified") {
      timer = setTimeout(() => show(element, false), SHOWN_MS);
    }
    const looks = { running: "", verified: "good", failed: "bad" };
    const signs = { running: "…", verified: "✓", failed: "✗" };
    element.className = `card transfer ${looks[upload.state]}`;
    fill(element, h("span", {}, `${signs[upload.state]} ${texts.upload[upload.state](upload)}`), upload.state === "running" && upload.count > 0 && h("progress", { max: String(upload.count), value: String(upload.done), "aria-label": texts.upload.running(upload) }),
      upload.state !== "running" && upload.text && h("p", {}, upload.text), upload.advice && h("p", {}, upload.advice), upload.backup && h("p", { class: "quiet" }, texts.upload.backup(upload.backup)));
  });
  return element;
}

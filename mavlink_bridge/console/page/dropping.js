/** Files dropped anywhere on the page. */

import { h } from "./dom.js";
import { texts } from "./texts.js";

/** @param {(file: File) => void} onfile */
export function acceptDrops(onfile) {
  const veil = h("div", { class: "drop-veil", hidden: true, "aria-hidden": "true" }, texts.files.dropNow);
  document.body.append(veil);
  let depth = 0;
  const hasFiles = (/** @type {any} */ event) => event.dataTransfer?.types.includes("Files");
  document.addEventListener("dragenter", (event) => {
    if (hasFiles(event)) {
      depth += 1;
      veil.hidden = false;
    }
  });
  document.addEventListener("dragleave", (event) => {
    if (hasFiles(event)) {
      depth -= 1;
      veil.hidden = depth > 0 ? veil.hidden : true;
    }
  });
  document.addEventListener("dragover", (event) => hasFiles(event) && event.preventDefault());
  document.addEventListener("drop", (event) => {
    if (hasFiles(event)) {
      event.preventDefault();
      depth = 0;
      veil.hidden = true;
      [...(event.dataTransfer?.files ?? [])].forEach(onfile);
    }
  });
}

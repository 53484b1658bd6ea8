import js from "@eslint/js";

const browser = ["AbortController", "AbortSignal", "Blob", "CSS", "CustomEvent", "DOMParser", "DataTransfer", "Element", "Event", "File", "FormData", "HTMLElement",
  "HTMLButtonElement", "HTMLCanvasElement", "HTMLDialogElement", "HTMLInputElement", "HTMLSelectElement", "HTMLTextAreaElement", "Image", "KeyboardEvent",
  "Node", "PointerEvent", "ResizeObserver", "Response", "SVGElement", "URL", "URLSearchParams", "WebSocket", "cancelAnimationFrame", "clearInterval",
  "clearTimeout", "console", "crypto", "customElements", "devicePixelRatio", "document", "fetch", "getComputedStyle", "history", "location", "localStorage",
  "matchMedia", "navigator", "performance", "pmtiles", "queueMicrotask", "reportError", "requestAnimationFrame", "sessionStorage", "setInterval", "setTimeout", "structuredClone", "window"];

export default [
  { ignores: ["**/vendor/**"] },
  js.configs.recommended,
  {
    files: ["**/*.js"],
    languageOptions: { ecmaVersion: 2022, sourceType: "module", globals: Object.fromEntries(browser.map((name) => [name, "readonly"])) },
    linterOptions: { reportUnusedDisableDirectives: "error" },
    rules: {
      "no-restricted-properties": ["error",
        { property: "innerHTML", message: "Texts from outside never become markup: use dom.js." },
        { property: "outerHTML", message: "Texts from outside never become markup: use dom.js." },
        { property: "insertAdjacentHTML", message: "Texts from outside never become markup: use dom.js." },
        { object: "document", property: "write", message: "Texts from outside never become markup: use dom.js." }],
      "no-eval": "error", "no-implied-eval": "error", "no-new-func": "error", "no-script-url": "error",
      "eqeqeq": "error", "prefer-const": "error", "no-var": "error", "curly": "error", "no-shadow": "error", "no-console": "error",
      "max-lines": ["error", 420], "max-lines-per-function": ["error", { max: 60, skipBlankLines: true, skipComments: true }], "complexity": ["error", 20],
    },
  },
];

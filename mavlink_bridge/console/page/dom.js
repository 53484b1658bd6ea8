/** Elements made without markup: what comes from outside is always text, never HTML. */

/** @typedef {Node | string | number | null | undefined | false} Child */

/**
 * Make an element.
 * @template {keyof HTMLElementTagNameMap} K
 * @param {K} tag
 * @param {Record<string, any>} [attributes] `on…` listens, `class`, `data-*` and `aria-*` are set as they are; false and null leave one out.
 * @param {...(Child | Child[])} children
 * @returns {HTMLElementTagNameMap[K]}
 */
export function h(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  decorate(element, attributes);
  element.append(...nodes(children.flat()));
  return element;
}

/**
 * Make an element of a drawing (SVG).
 * @param {string} tag
 * @param {Record<string, any>} [attributes]
 * @param {...(Child | Child[])} children
 * @returns {SVGElement}
 */
export function svg(tag, attributes = {}, ...children) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  decorate(element, attributes);
  element.append(...nodes(children.flat()));
  return element;
}

/** How large the page's letters are against the usual 16 px: on a large screen, and for who has set larger ones. */
export function letterScale() {
  return parseFloat(getComputedStyle(document.documentElement).fontSize) / 16;
}

/**
 * Put other children into an element.
 * @param {Element} element
 * @param {...(Child | Child[])} children
 */
export function fill(element, ...children) {
  element.replaceChildren(...nodes(children.flat()));
}

const TURNING = /[\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069]/gu;
const UNSEEN = /[\p{Cc}\p{Cf}\p{Zl}\p{Zp}]/gu;
const NAME_LETTERS = 80; // of a name from outside that are shown; chosen

/** @param {string} sign */
const escaped = (sign) => `\\u${(sign.codePointAt(0) ?? 0).toString(16).padStart(4, "0")}`;

/**
 * A text in which nothing turns the direction of writing: names from files and texts of vehicles must not rearrange what stands beside them.
 * @param {string} text
 */
function straight(text) {
  return text.replace(TURNING, escaped);
}

/**
 * A name from outside, such as a file's, as it is shown: short and in one line.
 * @param {string} name
 */
export function shownName(name) {
  const seen = [...name.replace(UNSEEN, escaped)];
  return seen.length > NAME_LETTERS ? `${seen.slice(0, NAME_LETTERS).join("")}…` : seen.join("");
}

/**
 * Set an element's text, if it is another one: screen readers are not told the same twice.
 * @param {Element} element
 * @param {string} text
 */
export function say(element, text) {
  const shown = straight(text);
  if (element.textContent !== shown) {
    element.textContent = shown;
  }
}

/**
 * Show or hide an element; what has the focus and is hidden hands it on.
 * @param {HTMLElement} element
 * @param {boolean} isShown
 */
export function show(element, isShown) {
  if (element.hidden === isShown) {
    const hadFocus = !isShown && element.contains(document.activeElement);
    const { parentElement } = element;
    element.hidden = !isShown;
    if (hadFocus && parentElement) {
      // What takes its place may be shown only after it.
      queueMicrotask(() => focusIn(parentElement, 0));
    }
  }
}

const FOCUSABLE = "button:not(:disabled), input:not(:disabled), select:not(:disabled), textarea, summary, [tabindex='0']";

/**
 * Give the focus to an element's nth control, else to its last, else to one of what it stands in: who works with keys goes on from where they were.
 * @param {Element} element
 * @param {number} index
 */
export function focusIn(element, index) {
  const found = /** @type {HTMLElement[]} */ ([...element.querySelectorAll(FOCUSABLE)]).filter((one) => one.getClientRects().length > 0);
  if (found.length > 0) {
    found[Math.min(index, found.length - 1)].focus({ preventScroll: true });
  } else if (element.parentElement) {
    focusIn(element.parentElement, 0);
  }
}

/**
 * Build an element's children anew and leave the focus where it was among them.
 * @param {Element} element
 * @param {() => void} build
 */
export function keepFocus(element, build) {
  const { activeElement } = document;
  if (!activeElement || activeElement === element || !element.contains(activeElement)) {
    build();
    return;
  }
  const name = activeElement.getAttribute("aria-label");
  const index = [...element.querySelectorAll(FOCUSABLE)].indexOf(activeElement);
  build();
  const same = /** @type {HTMLElement | null} */ (name && element.querySelector(`[aria-label="${CSS.escape(name)}"]:not(:disabled)`));
  if (same) {
    same.focus({ preventScroll: true });
  } else {
    focusIn(element, Math.max(0, index));
  }
}

/**
 * Let the browser save a file.
 * @param {string} name
 * @param {Blob} data
 */
export function saveAs(name, data) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(data);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

/**
 * @param {Element} element
 * @param {Record<string, any>} attributes
 */
function decorate(element, attributes) {
  for (const [name, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) {
      continue;
    }
    if (name.startsWith("on")) {
      element.addEventListener(name.slice(2), value);
    } else if (name === "value" || name === "checked") {
      // The element's present value, not only its first one.
      Object.assign(element, { [name]: value });
    } else {
      element.setAttribute(name, value === true ? "" : straight(String(value)));
    }
  }
}

/**
 * @param {Child[]} children
 * @returns {(Node | string)[]}
 */
function nodes(children) {
  return children
    .filter((child) => child !== null && child !== undefined && child !== false)
    .map((child) => (typeof child === "number" ? String(child) : typeof child === "string" ? straight(child) : /** @type {Node} */ (child)));
}

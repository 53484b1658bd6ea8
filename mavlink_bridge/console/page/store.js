/** What the page knows, in sections; who shows a section is told when it is another one. */

/**
 * @template {object} State
 */
export class Store {
  /** @param {State} state */
  constructor(state) {
    this.state = state;
    /** @type {{keys: Set<string>, listen: (state: State) => void}[]} */
    this.listeners = [];
    /** @type {Set<string>} */
    this.changed = new Set();
    this.isTelling = false;
  }

  /**
   * Change sections; listeners are told once, after what is being done now.
   * @param {Partial<State>} sections
   */
  set(sections) {
    for (const [name, value] of Object.entries(sections)) {
      if (/** @type {any} */ (this.state)[name] !== value) {
        this.changed.add(name);
      }
    }
    this.state = { ...this.state, ...sections };
    if (this.changed.size > 0 && !this.isTelling) {
      this.isTelling = true;
      queueMicrotask(() => this.tell());
    }
  }

  /**
   * Listen to sections, and hear at once what they are.
   * @param {(keyof State & string)[]} keys
   * @param {(state: State) => void} listen
   */
  watch(keys, listen) {
    this.listeners.push({ keys: new Set(keys), listen });
    listen(this.state);
  }

  tell() {
    const changed = this.changed;
    this.changed = new Set();
    this.isTelling = false;
    for (const { keys, listen } of this.listeners) {
      if ([...changed].some((name) => keys.has(name))) {
        try {
          listen(this.state);
        } catch (error) {
          // A fault in one part must not keep the others, HOLD's answer among them, from showing what is.
          reportError(error);
        }
      }
    }
  }
}

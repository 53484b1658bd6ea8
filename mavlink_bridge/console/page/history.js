/** What a person has drawn and asked for, with everything undone and redone. */

const MOST = 200; // steps that can be undone; chosen: more than a person goes back

/**
 * @template Value
 */
export class History {
  /**
   * @param {Value} value
   * @param {(value: Value) => void} onchange
   */
  constructor(value, onchange) {
    this.value = value;
    this.onchange = onchange;
    /** @type {{name: string, value: Value}[]} */
    this.past = [];
    /** @type {{name: string, value: Value}[]} */
    this.future = [];
    /** @type {string | null} */
    this.running = null;
  }

  /**
   * Take a step. Steps of one gesture (a drag, a slider) share `gesture` and are undone together.
   * @param {string} name what it is called in "undo …"
   * @param {Value} value
   * @param {string | null} [gesture]
   */
  change(name, value, gesture = null) {
    if (gesture === null || gesture !== this.running) {
      this.past = [...this.past, { name, value: this.value }].slice(-MOST);
    }
    this.running = gesture;
    this.future = [];
    this.value = value;
    this.onchange(value);
  }

  /** A gesture has ended: the next step is one of its own. */
  settle() {
    this.running = null;
  }

  undo() {
    const step = this.past.pop();
    if (step) {
      this.future.push({ name: step.name, value: this.value });
      this.leap(step.value);
    }
    return step?.name ?? null;
  }

  redo() {
    const step = this.future.pop();
    if (step) {
      this.past.push({ name: step.name, value: this.value });
      this.leap(step.value);
    }
    return step?.name ?? null;
  }

  /** @param {Value} value */
  leap(value) {
    this.running = null;
    this.value = value;
    this.onchange(value);
  }
}

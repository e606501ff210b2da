/** Frames: draws at most once for each picture of the screen, and only after something has changed. */

type Schedule = (draw: () => void) => void;

export class Frames {
  readonly #listeners = new Set<() => void>();
  readonly #schedule: Schedule;
  #isRequested = false;

  constructor(schedule: Schedule = (draw) => void requestAnimationFrame(draw)) {
    this.#schedule = schedule;
  }

  /** Calls the listener with each frame that was requested, until the returned function is called. */
  listen(listener: () => void): () => void {
    this.#listeners.add(listener);
    return () => this.#listeners.delete(listener);
  }

  /** Requests the next frame. */
  request(): void {
    if (this.#isRequested || this.#listeners.size === 0) return;
    this.#isRequested = true;
    this.#schedule(() => {
      this.#isRequested = false;
      for (const listener of [...this.#listeners]) listener();
    });
  }
}

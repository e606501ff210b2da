/** Seeking: one request to a recording at a time; of those that come meanwhile the last. */

export interface Seek {
  readonly stamp_ns?: string;
  readonly play?: boolean;
  readonly rate?: number;
}

export class Seeking {
  readonly #ask: (seek: Seek) => Promise<unknown>;
  readonly #failed: (error: unknown) => void;
  #next: Seek | undefined;
  #isBusy = false;

  constructor(ask: (seek: Seek) => Promise<unknown>, failed: (error: unknown) => void) {
    this.#ask = ask;
    this.#failed = failed;
  }

  /** Asks for a place, for playing or pausing, or for another rate. */
  seek(seek: Seek): void {
    this.#next = { ...this.#next, ...seek };
    if (!this.#isBusy) void this.#run();
  }

  async #run(): Promise<void> {
    this.#isBusy = true;
    try {
      while (this.#next !== undefined) {
        const seek = this.#next;
        this.#next = undefined;
        await this.#ask(seek);
      }
    } catch (error) {
      this.#next = undefined;
      this.#failed(error);
    } finally {
      this.#isBusy = false;
    }
  }
}

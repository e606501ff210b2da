/** Timeline: the stretch of time that all plots of a page show, and their two cursors. */

import { computed, signal } from "@preact/signals";
import { secondsBetween, stampAfter } from "../messages/stamps";

const HOUR_NS = 3_600_000_000_000n;
export const SPANS_S = [5, 10, 30, 60] as const;
const LEAST_ZOOM_S = 1e-6;

export interface Stretch {
  readonly from: number;
  readonly to: number;
}

export type Cursors = readonly [a: number | undefined, b: number | undefined];

export class Timeline {
  #originNs: bigint | undefined;
  readonly spanS = signal<number>(30);
  /** Moment at which the plots were paused; undefined while they run. */
  readonly pausedS = signal<number | undefined>(undefined);
  /** Stretch that a person has chosen; undefined while the plots show the newest. */
  readonly zoom = signal<Stretch | undefined>(undefined);
  /** The whole of a recording, while the plots show it; undefined while they show what has come. */
  readonly whole = signal<Stretch | undefined>(undefined);
  readonly cursors = signal<Cursors>([undefined, undefined]);
  readonly isPaused = computed(() => this.pausedS.value !== undefined);

  /** Returns a stamp in seconds since the origin: the full hour before the first stamp. */
  secondsOf(stampNs: bigint): number {
    this.#originNs ??= stampNs - (stampNs % HOUR_NS);
    return secondsBetween(this.#originNs, stampNs);
  }

  /** Returns the stamp of a moment. */
  stampOf(timeS: number): bigint {
    return stampAfter(this.#originNs ?? 0n, timeS);
  }

  /** Returns what the plots show when the newest point is at `newestS`. */
  stretch(newestS: number): Stretch {
    const to = this.pausedS.peek() ?? newestS;
    return this.zoom.peek() ?? this.whole.peek() ?? { from: to - this.spanS.peek(), to };
  }

  /** Shows a stretch of time; one of no length shows the newest again. */
  show(stretch: Stretch | undefined): void {
    this.zoom.value = stretch !== undefined && stretch.to - stretch.from >= LEAST_ZOOM_S ? stretch : undefined;
  }

  /** Puts a cursor, 0 or 1, at a moment; undefined takes it away. */
  putCursor(which: 0 | 1, timeS: number | undefined): void {
    const [a, b] = this.cursors.peek();
    this.cursors.value = which === 0 ? [timeS, b] : [a, timeS];
  }

  clearCursors(): void {
    this.cursors.value = [undefined, undefined];
  }
}

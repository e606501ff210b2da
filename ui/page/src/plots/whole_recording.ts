/** Whole recording: the lines of all plots over a recording, or over a stretch of it, thinned by the server. */

import { effect } from "@preact/signals";
import type { Overview, OverviewRequest } from "../connection/answers";
import { newRevision, type Points } from "../messages/ring";
import type { Frames } from "./frames";
import type { Line, Lines } from "./lines";
import type { Stretch, Timeline } from "./timeline";

const BINS = 2000;

export type AskOverview = (request: OverviewRequest) => Promise<Overview>;

export class WholeRecording {
  readonly #ask: AskOverview;
  readonly #timeline: Timeline;
  readonly #lines: Lines;
  readonly #frames: Frames;
  /** Number of the stretch that is being asked for; an answer for another one comes too late. */
  #turn = 0;

  constructor(ask: AskOverview, timeline: Timeline, lines: Lines, frames: Frames) {
    this.#ask = ask;
    this.#timeline = timeline;
    this.#lines = lines;
    this.#frames = frames;
    effect(() => {
      // The number of openings is read so that a line that is opened later is asked for too.
      const [whole, zoom] = [timeline.whole.value, timeline.zoom.value, lines.openings.value];
      this.#turn += 1;
      if (whole === undefined) this.#end();
      else void this.#show(zoom ?? whole, this.#turn);
    });
  }

  #end(): void {
    for (const line of this.#lines.opened) line.showRecorded(undefined);
    this.#frames.request();
  }

  async #show(stretch: Stretch, turn: number): Promise<void> {
    await Promise.resolve(); // lines that are opened together are asked for once
    for (const line of this.#lines.opened) {
      if (turn !== this.#turn) return;
      await this.#showLine(line, stretch, turn);
    }
  }

  async #showLine(line: Line, { from, to }: Stretch, turn: number): Promise<void> {
    const { topic, path } = line.address;
    const [from_ns, to_ns] = [from, to].map((each) => String(this.#timeline.stampOf(each))) as [string, string];
    try {
      const found = await this.#ask({ topic, path, from_ns, to_ns, bins: BINS });
      if (turn !== this.#turn) return;
      line.showRecorded(pointsOf(found, this.#timeline));
      this.#frames.request();
    } catch {
      line.showRecorded(undefined); // the recording has no such field, which its last message says too
    }
  }
}

function pointsOf({ from_ns: fromNs, times_s: times, values }: Overview, timeline: Timeline): Points {
  const start = timeline.secondsOf(BigInt(fromNs));
  return {
    times: Float64Array.from(times, (each) => start + each),
    values: Float64Array.from(values, (each) => each ?? NaN),
    revision: newRevision(),
  };
}

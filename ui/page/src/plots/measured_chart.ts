/** Measured chart: 20 lines of 10,000 points that grow with each frame; bundle it, open it, and call `measure(100)` in the console. */

import { signal } from "@preact/signals";
import type { Channel } from "../connection/protocol";
import type { Listener } from "../connection/topics";
import "uplot/dist/uPlot.min.css";
import { Chart } from "./chart";
import { Observation } from "./observation";

const LINES = 20;
const POINTS = 10_000;
const SPAN_S = 30;

interface Measured {
  readonly framesPerSecond: number;
  /** Median time of a frame in the page's own thread; what the browser paints after that is not in it. */
  readonly drawnMs: number;
}

let draw: (() => void) | undefined;

/** Makes the chart with all its points; each later call of `measure` draws it on. */
function make(): () => void {
  let send: Listener = () => undefined;
  const channel: Channel = { id: 1, topic: "/wave", encoding: "json", schemaName: "Wave", schema: "" };
  const observation = new Observation({
    isOpen: signal(true),
    topics: {
      channels: signal(new Map([["/wave", channel]])),
      listen: (_: string, listener: Listener) => {
        send = listener;
        return () => undefined;
      },
    } as never,
  });
  const host = document.createElement("div");
  Object.assign(host.style, { width: "1200px", height: "600px" });
  document.body.append(host);
  const chart = new Chart(host, observation, () => undefined);
  const lines = Array.from({ length: LINES }, (_, at) => observation.lines.open(`wave.y[${at}]`));
  let sent = 0;
  const sendNext = (): void => {
    const seconds = (sent * SPAN_S) / POINTS;
    const y = lines.map((_, at) => Math.sin(seconds * (1 + at / 7)) + at + (Math.random() - 0.5) * 0.4);
    const data = new DataView(new TextEncoder().encode(JSON.stringify({ y })).buffer);
    send({ channel, stampNs: BigInt(Math.round(seconds * 1e9)) + 1_000_000_000n, data });
    sent += 1;
  };
  while (sent < POINTS) sendNext();
  chart.setLines(lines);
  return () => {
    for (let each = 0; each < POINTS / SPAN_S / 60; each += 1) sendNext();
    chart.draw();
  };
}

/** Draws so many frames, which take as long as they take; returns how many came in a second. */
async function measure(frames: number): Promise<Measured> {
  draw ??= make();
  const nextFrame = (): Promise<number> => new Promise(requestAnimationFrame);
  const took: number[] = [];
  const from = await nextFrame();
  let to = from;
  while (took.length < frames) {
    const before = performance.now();
    draw();
    await Promise.resolve(); // uPlot draws after the batch
    took.push(performance.now() - before);
    to = await nextFrame();
  }
  took.sort((one, other) => one - other);
  return { framesPerSecond: (frames / (to - from)) * 1000, drawnMs: took[frames >> 1] ?? NaN };
}

Object.assign(globalThis, { measure });

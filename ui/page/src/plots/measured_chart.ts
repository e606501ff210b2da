/** Measured chart: 20 lines of 10,000 points that grow with each frame; bundle it, open it, and call `measure()` in the console. */

import { signal } from "@preact/signals";
import type { Channel } from "../connection/protocol";
import type { Listener } from "../connection/topics";
import "uplot/dist/uPlot.min.css";
import { Chart } from "./chart";
import { Observation } from "./observation";

const LINES = 20;
const POINTS = 10_000;
const SPAN_S = 30;
const FRAMES = 30;

/** Draws some frames; returns how many came in a second, and what the drawing of one costs. */
async function measure(): Promise<{ framesPerSecond: number; drawnMs: number; points: number }> {
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
  const nextFrame = (): Promise<number> => new Promise(requestAnimationFrame);
  let drawnMs = 0;
  const from = await nextFrame();
  let to = from;
  for (let frame = 0; frame < FRAMES; frame += 1) {
    const before = performance.now();
    for (let each = 0; each < POINTS / SPAN_S / 60; each += 1) sendNext();
    chart.draw();
    await Promise.resolve(); // uPlot draws after the batch
    drawnMs += performance.now() - before;
    to = await nextFrame();
  }
  return { framesPerSecond: (FRAMES / (to - from)) * 1000, drawnMs: drawnMs / FRAMES, points: lines[0]?.points.times.length ?? 0 };
}

Object.assign(globalThis, { measure });

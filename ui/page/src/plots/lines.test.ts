import assert from "node:assert/strict";
import test from "node:test";
import { signal } from "@preact/signals";
import type { Channel } from "../connection/protocol";
import type { Listener } from "../connection/topics";
import { Receiver } from "../messages/receiver";
import { Frames } from "./frames";
import { Lines, type Line } from "./lines";
import { Timeline } from "./timeline";

const SECOND = 1_000_000_000n;
const START = 1_795_500_000n * SECOND;

/** Lines of topics without a connection. */
function fixture() {
  const listeners = new Map<string, Listener>();
  const channels = signal<ReadonlyMap<string, Channel>>(new Map());
  const listen = (topic: string, listener: Listener): (() => void) => {
    listeners.set(topic, listener);
    return () => listeners.delete(topic);
  };
  const receiver = new Receiver({ channels, listen });
  const [timeline, changes] = [new Timeline(), { count: 0 }];
  const lines = new Lines(receiver, timeline, () => (changes.count += 1));
  const send = (topic: string, seconds: number, message: unknown): void => {
    const channel = { id: 1, topic, encoding: "json", schemaName: "A", schema: "" };
    const data = new DataView(new TextEncoder().encode(JSON.stringify(message)).buffer);
    listeners.get(topic)?.({ channel, stampNs: START + BigInt(Math.round(seconds * 1e9)), data });
  };
  return { receiver, timeline, lines, send, listeners, changes };
}

/** Seconds after the start, and values, of what a line draws. */
function drawn(line: Line, timeline: Timeline): (readonly [number, number])[] {
  const { times, values } = line.points;
  return [...times].map((time, at) => [Number(timeline.stampOf(time) - START) / 1e9, values[at]!] as const);
}

test("a line has the numbers of its field", () => {
  const { timeline, lines, send } = fixture();
  const line = lines.open("/a.x[1]");
  send("/a", 1, { x: [0, 5] });
  send("/a", 2, { x: [0, true] });
  assert.deepEqual(drawn(line, timeline), [[1, 5], [2, 1]]);
  assert.deepEqual([line.text, line.fault], ["a.x[1]", undefined]);
});

test("a line stands by the header's stamp", () => {
  const { timeline, lines, send } = fixture();
  const line = lines.open("a.x");
  send("/a", 2, { x: 1, header: { stamp: { sec: Number(START / SECOND), nanosec: 5 } } });
  assert.equal(timeline.stampOf(line.points.times[0]!), START + 5n);
});

test("a message without the named item leaves no gap", () => {
  const { timeline, lines, send } = fixture();
  const line = lines.open("tf.transforms[imu].x");
  const transforms = (child_frame_id: string, x: number) => ({ transforms: [{ child_frame_id, x }] });
  send("/tf", 1, transforms("pelvis", 7));
  assert.equal(line.fault, "the last message has no value there");
  send("/tf", 2, transforms("imu", 1));
  send("/tf", 3, transforms("pelvis", 7));
  send("/tf", 4, transforms("imu", 2));
  assert.deepEqual([drawn(line, timeline), line.fault], [[[2, 1], [4, 2]], undefined]);
});

test("what has no number leaves a gap and a reason", () => {
  const { timeline, lines, send } = fixture();
  const line = lines.open("a.x");
  send("/a", 1, { x: "one" });
  assert.deepEqual([line.points.times.length, line.fault], [0, "the last message has no number there"]);
  send("/a", 2, { x: 1 });
  send("/a", 3, {});
  assert.equal(line.fault, "the last message has no value there");
  assert.deepEqual(drawn(line, timeline), [[2, 1], [3, NaN]]);
});

test("plots share a line and its past", () => {
  const { receiver, timeline, lines, send } = fixture();
  const end = receiver.follow("/a", () => undefined);
  send("/a", 1, { x: 1, y: 2 });
  const [first, second] = [lines.open("a.x"), lines.open("/a.x")];
  assert.equal(first, second);
  assert.deepEqual(drawn(lines.open("a.y"), timeline), [[1, 2]]);
  end();
  lines.close(first);
  send("/a", 2, { x: 3 });
  assert.equal(drawn(second, timeline).length, 2, "the other plot goes on");
});

test("a line ends with its last plot", () => {
  const { lines, listeners } = fixture();
  const line = lines.open("a.x");
  lines.open("a.x");
  lines.close(line);
  assert.equal(listeners.size, 1);
  lines.close(line);
  lines.close(line);
  assert.equal(listeners.size, 0);
});

test("a paused line stays, and goes on unseen", () => {
  const { timeline, lines, send } = fixture();
  const line = lines.open("a.x");
  send("/a", 1, { x: 1 });
  lines.hold();
  for (let at = 2; at < 100; at += 1) send("/a", at, { x: at });
  assert.deepEqual(drawn(line, timeline), [[1, 1]]);
  lines.release();
  assert.equal(drawn(line, timeline).length, 61);
});

test("a jump of time takes all lines along", () => {
  const { timeline, lines, send } = fixture();
  const [a, b] = [lines.open("a.x"), lines.open("b.x")];
  for (const at of [10, 20, 30]) for (const topic of ["/a", "/b"]) send(topic, at, { x: at });
  send("/a", 15, { x: 1 });
  assert.deepEqual(drawn(a, timeline), [[10, 10], [15, NaN], [15, 1]]);
  assert.deepEqual(drawn(b, timeline), [[10, 10]]);
  assert.equal(Number(timeline.stampOf(lines.newestS!) - START) / 1e9, 15);
});

test("a step in a recording breaks the lines", () => {
  const { timeline, lines, send } = fixture();
  const line = lines.open("a.x");
  for (const at of [10, 20, 30]) send("/a", at, { x: at });
  lines.continueFrom(timeline.secondsOf(START + 25n * SECOND));
  send("/a", 40, { x: 4 });
  assert.deepEqual(drawn(line, timeline), [[10, 10], [20, 20], [20, NaN], [40, 4]]);
});

test("many changes draw once", () => {
  let [draws, waiting] = [0, [] as (() => void)[]];
  const frames = new Frames((draw) => waiting.push(draw));
  frames.request();
  assert.equal(waiting.length, 0, "nothing listens");
  frames.listen(() => (draws += 1));
  for (let at = 0; at < 10; at += 1) frames.request();
  assert.equal(waiting.length, 1);
  waiting[0]!();
  assert.equal(draws, 1);
  waiting = [];
  frames.request();
  assert.equal(waiting.length, 1);
});

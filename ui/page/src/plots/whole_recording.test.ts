import assert from "node:assert/strict";
import { test } from "node:test";
import { signal } from "@preact/signals";
import type { Overview, OverviewRequest } from "../connection/answers";
import { Receiver } from "../messages/receiver";
import { Frames } from "./frames";
import { Lines } from "./lines";
import { Timeline } from "./timeline";
import { WholeRecording } from "./whole_recording";

const START = 1_795_500_000_000_000_000n;

function fixture() {
  const asked: OverviewRequest[] = [];
  const answers: ((answer: Overview) => void)[] = [];
  const timeline = new Timeline();
  const lines = new Lines(new Receiver({ channels: signal(new Map()), listen: () => () => undefined }), timeline, () => undefined);
  const ask = (request: OverviewRequest): Promise<Overview> => {
    asked.push(request);
    return new Promise((resolve) => answers.push(resolve));
  };
  new WholeRecording(ask, timeline, lines, new Frames(() => undefined));
  const whole = { from: timeline.secondsOf(START), to: timeline.secondsOf(START) + 60 };
  return { asked, answers, timeline, lines, whole };
}

const settled = (): Promise<void> => new Promise((resolve) => setImmediate(resolve));

test("the whole recording is asked for as one stretch", async () => {
  const { asked, answers, timeline, lines, whole } = fixture();
  const line = lines.open("imu/data.position[knee]");
  timeline.whole.value = whole;
  await settled();
  assert.deepEqual(asked[0]!.path, ["position", { named: "knee" }]);
  assert.deepEqual([asked[0]!.from_ns, asked[0]!.to_ns], [String(START), String(START + 60_000_000_000n)]);
  answers[0]!({ from_ns: String(START), times_s: [0, 30], values: [1, null], every: 1 });
  await settled();
  assert.deepEqual([...line.points.times], [whole.from, whole.from + 30]);
  assert.deepEqual([...line.points.values], [1, NaN]);
  timeline.whole.value = undefined;
  assert.equal(line.points.times.length, 0);
});

test("a line that is opened later is asked for too", async () => {
  const { asked, timeline, lines, whole } = fixture();
  timeline.whole.value = whole;
  lines.open("imu/data.x");
  await settled();
  assert.deepEqual(asked.map(({ topic }) => topic), ["/imu/data"]);
});

test("a stretch is asked for anew, and a late answer is left out", async () => {
  const { asked, answers, timeline, lines, whole } = fixture();
  const line = lines.open("imu/data.x");
  timeline.whole.value = whole;
  await settled();
  timeline.show({ from: whole.from + 10, to: whole.from + 20 });
  await settled();
  assert.equal(asked[1]!.from_ns, String(START + 10_000_000_000n));
  answers[0]!({ from_ns: String(START), times_s: [0], values: [7], every: 1 });
  await settled();
  assert.equal(line.points.times.length, 0);
  answers[1]!({ from_ns: String(START), times_s: [11], values: [8], every: 1 });
  await settled();
  assert.deepEqual([...line.points.values], [8]);
});

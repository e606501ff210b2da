import assert from "node:assert/strict";
import { test } from "node:test";
import { counted, countText, durationText, namespaceOf, rateText, secondsText } from "./text";

test("rates have few digits at every size", () => {
  assert.deepEqual([0, 0.25, 9.94, 9.96, 99.6, 1000, 123_456].map(rateText), [
    "0 Hz",
    "0.3 Hz",
    "9.9 Hz",
    "10 Hz",
    "100 Hz",
    "1.0 kHz",
    "123 kHz",
  ]);
});

test("counts have their thousands set apart", () => {
  assert.equal(countText(1_234_567), "1\u202f234\u202f567");
  assert.equal(countText(999), "999");
  assert.deepEqual([counted(1, "node"), counted(2, "node")], ["1 node", "2 nodes"]);
});

test("times change their unit with their size", () => {
  assert.deepEqual([0, 0.000_05, 0.001_2, 0.5, 2.5, 120].map(secondsText), ["0", "50 µs", "1.2 ms", "500 ms", "2.5 s", "120 s"]);
  assert.deepEqual([-1, 65, 3723].map(durationText), ["0:00", "1:05", "1:02:03"]);
});

test("a namespace ends at the last slash", () => {
  assert.deepEqual([namespaceOf("/a/b"), namespaceOf("/b")], ["/a", "/"]);
});

import assert from "node:assert/strict";
import { test } from "node:test";
import { filtered, levelWord, nodesOf } from "./filter";

const LINES = [
  { stamp_ns: 1, level: 10, node: "/a", text: "details" },
  { stamp_ns: 2, level: 20, node: "/b", text: "All sensors OPERATIONAL" },
  { stamp_ns: 3, level: 40, node: "/a", text: "<b>failed</b>" },
];
const ALL = { level: 10, node: "", text: "" };
const stamps = (filter: Partial<typeof ALL>) => filtered(LINES, { ...ALL, ...filter }).map(({ stamp_ns }) => stamp_ns);

test("lines are chosen by level, node and text", () => {
  assert.deepEqual(stamps({}), [1, 2, 3]);
  assert.deepEqual(stamps({ level: 30 }), [3]);
  assert.deepEqual(stamps({ node: "/a" }), [1, 3]);
  assert.deepEqual(stamps({ text: "sensors operational" }), [2]);
  assert.deepEqual(stamps({ text: "/a failed" }), [3]);
  assert.deepEqual(stamps({ text: "sensors failed" }), []);
});

test("each level has a word, also between the known ones", () => {
  assert.deepEqual([5, 10, 25, 30, 49, 50, 99].map(levelWord), ["debug", "debug", "info", "warning", "error", "critical", "critical"]);
});

test("nodes are named once", () => {
  assert.deepEqual(nodesOf(LINES), ["/a", "/b"]);
});

import assert from "node:assert/strict";
import test from "node:test";
import { leafText, rowsOf, type Shown } from "./rows";

const AS_IT_BEGINS: Shown = { toggled: new Set(), items: new Map() };
const lines = (message: unknown, shown = AS_IT_BEGINS): string[] =>
  rowsOf(message, shown).map(({ depth, name, text, kind, isOpen }) => `${" ".repeat(depth - 1)}${name}${kind === "branch" ? (isOpen ? "-" : "+") : ":"} ${text}`);

test("a message is a tree of its fields", () => {
  assert.deepEqual(lines({ header: { stamp: { sec: 12, nanosec: 5_000_000 }, frame_id: "imu" }, on: true, large: 2n ** 63n - 1n, none: null }), [
    "header- ",
    " stamp- 12.005000 s",
    "  sec: 12",
    "  nanosec: 5000000",
    " frame_id: imu",
    "on: true",
    "large: 9223372036854775807",
    "none: null",
  ]);
});

test("items beside names bear them", () => {
  const joints = { name: ["hip", "knee"], position: new Float64Array([0.1, 0.30000000000000004]) };
  const rows = rowsOf(joints, AS_IT_BEGINS);
  assert.deepEqual(rows.map((row) => row.path), ["name", "name[0]", "name[1]", "position", "position[hip]", "position[knee]"]);
  assert.deepEqual(rows.slice(3).map((row) => row.text), ["2 × float64", "0.1", "0.3"]);
});

test("a long array is cut, and opened in steps", () => {
  const message = { data: new Uint8Array(1000) };
  assert.deepEqual(lines(message), ["data+ 1000 × uint8"]);
  const opened = { toggled: new Set(["data"]), items: new Map<string, number>() };
  assert.deepEqual([lines(message, opened).length, lines(message, opened).at(-1)], [22, " …: 980 more"]);
  assert.equal(lines(message, { ...opened, items: new Map([["data", 100]]) }).length, 102);
});

test("a tree has no more than 2000 rows", () => {
  const wide = Object.fromEntries(Array.from({ length: 5000 }, (_, at) => [`f${at}`, at]));
  assert.equal(rowsOf(wide, AS_IT_BEGINS).length, 2000);
});

test("a search shows matching fields in their branches", () => {
  const deep = { pose: { position: { x: 1, y: 2 }, orientation: { x: 0, y: 0 } }, joints: [{ name: "hip", torque: { limit: 55 } }], on: true };
  const search = (words: string): string[] => lines(deep, { ...AS_IT_BEGINS, search: words });
  assert.deepEqual(search("Position X"), ["pose- ", " position- ", "  x: 1"]);
  assert.deepEqual(search("55"), ["joints- 1 × message", " hip- ", "  torque- ", "   limit: 55"]);
  assert.deepEqual(search("on: "), []);
  assert.deepEqual(search(" "), lines(deep));
});

test("markup and control characters stay text", () => {
  assert.equal(leafText("<img src=x onerror=alert(1)>"), "<img src=x onerror=alert(1)>");
  assert.equal(leafText("a\u001b[31mb\n\u202ec"), "a\\u001b[31mb\\u000a\\u202ec");
  assert.equal(leafText("x".repeat(1000)).length, 301);
  assert.equal(leafText(NaN), "NaN");
});

test("a message that is no object is shown", () => {
  assert.deepEqual(lines(5), ["message: 5"]);
});

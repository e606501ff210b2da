import assert from "node:assert/strict";
import test from "node:test";
import { characters, stretchOf, unitsBefore } from "./places";

test("characters are counted as Python counts them", () => {
  assert.equal(characters("a🤖ü"), 3);
  assert.equal(unitsBefore("a🤖ü", 2), 3);
  assert.equal(unitsBefore("a", 9), 1);
});

test("a stretch is the common part of a text and a citation", () => {
  const placed = { text: "grün 🤖 here", first: 10, last: undefined };
  assert.deepEqual(stretchOf(placed, 15, 18), { from: 5, to: 9 });
  assert.deepEqual(stretchOf(placed, 0, 12), { from: 0, to: 2 });
  assert.deepEqual(stretchOf(placed, 17, 99), { from: 8, to: 12 });
  assert.equal(stretchOf(placed, 21, 30), undefined);
  assert.equal(stretchOf(placed, 0, 10), undefined);
});

test("text that differs from its source is shown whole", () => {
  assert.deepEqual(stretchOf({ text: "&", first: 3, last: 8 }, 5, 6), { from: 0, to: 1 });
  assert.equal(stretchOf({ text: "&", first: 3, last: 8 }, 8, 9), undefined);
});

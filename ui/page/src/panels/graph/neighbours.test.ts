import assert from "node:assert/strict";
import { test } from "node:test";
import { nearest } from "./neighbours";

const box = (x: number, y: number) => ({ x, y, width: 10, height: 10 });
const BOXES = new Map([["a", box(0, 0)], ["b", box(100, 5)], ["c", box(100, 200)], ["d", box(0, 100)]]);

test("arrow keys go to the nearest in their direction", () => {
  assert.equal(nearest(BOXES, "a", "right"), "b");
  assert.equal(nearest(BOXES, "a", "down"), "d");
  assert.equal(nearest(BOXES, "c", "up"), "b");
  assert.equal(nearest(BOXES, "b", "left"), "a");
});

test("nothing lies beyond the edge", () => {
  assert.equal(nearest(BOXES, "a", "left"), null);
  assert.equal(nearest(BOXES, "nowhere", "left"), null);
});

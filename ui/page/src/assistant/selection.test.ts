import assert from "node:assert/strict";
import test from "node:test";
import { cut, MOST_BYTES } from "./selection";

test("a selection is cut at 20 kB, between characters", () => {
  assert.deepEqual(cut("short"), { text: "short", isCut: false });
  assert.equal(cut("a".repeat(MOST_BYTES)).isCut, false);
  const { text, isCut } = cut(`a${"🤖".repeat(6000)}`);
  assert.equal(isCut, true);
  assert.equal(text, `a${"🤖".repeat(4999)}`);
});

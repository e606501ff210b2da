import assert from "node:assert/strict";
import { test } from "node:test";
import { backoffMs } from "./backoff";

test("the pause doubles up to five seconds", () => {
  const pauses = [1, 2, 3, 4, 5, 6, 7, 100].map((failures) => backoffMs(failures, () => 0.5));
  assert.deepEqual(pauses, [250, 500, 1000, 2000, 4000, 5000, 5000, 5000]);
});

test("pauses are spread by a fifth", () => {
  assert.equal(backoffMs(3, () => 0), 800);
  assert.equal(backoffMs(3, () => 1), 1200);
});

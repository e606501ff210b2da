import assert from "node:assert/strict";
import { test } from "node:test";

test("limits of a test replace those of the page", async () => {
  globalThis.busflowLimits = { answer: 1 };
  const { limits } = await import("./limits");
  assert.deepEqual([limits.answer, limits.copied], [1, 1_500]);
});

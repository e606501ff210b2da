import assert from "node:assert/strict";
import test from "node:test";
import { copiedText } from "./copying";

test("of a console its commands are copied", () => {
  assert.equal(copiedText("$ busflow check a.yaml\nno problems\n$ busflow run a.yaml\n", "console"), "busflow check a.yaml\nbusflow run a.yaml\n");
  assert.equal(copiedText("no prompt\n", "console"), "no prompt\n");
  assert.equal(copiedText("$ x", "sh"), "$ x");
});

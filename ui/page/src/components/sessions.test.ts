import assert from "node:assert/strict";
import test from "node:test";
import { socketAddress } from "./sessions";

test("a server's address leads to its socket", () => {
  assert.equal(socketAddress("http://127.0.0.1:8766"), "ws://127.0.0.1:8766/ws");
  assert.equal(socketAddress("https://robot.lab/ui/?x=1#token=a"), "wss://robot.lab/ui/ws");
  assert.throws(() => socketAddress("javascript:alert(1)"));
  assert.throws(() => socketAddress("robot"));
});

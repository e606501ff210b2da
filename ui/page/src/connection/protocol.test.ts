import assert from "node:assert/strict";
import { test } from "node:test";
import { callFrame, messageFrame, readFrame } from "./protocol";

function bytes(...parts: (readonly number[])[]): ArrayBuffer {
  return Uint8Array.from(parts.flat()).buffer;
}

test("a message's subscription, stamp and payload are read", () => {
  const message = readFrame(bytes([1], [7, 0, 0, 0], [0, 1, 0, 0, 0, 0, 0, 0], [42, 43]));
  assert.ok(message?.op === "messageData");
  assert.deepEqual([message.subscription, message.stampNs, message.data.byteLength], [7, 256n, 2]);
  assert.equal(message.data.getUint8(1), 43);
});

test("a service's answer is read with its encoding", () => {
  const message = readFrame(bytes([3], [1, 0, 0, 0], [9, 0, 0, 0], [3, 0, 0, 0], [99, 100, 114], [5]));
  assert.ok(message?.op === "callAnswered");
  assert.deepEqual([message.service, message.call, message.encoding, message.data.getUint8(0)], [1, 9, "cdr", 5]);
});

test("frames cut short are no messages", () => {
  assert.equal(readFrame(bytes([1], [7, 0, 0, 0])), null);
  assert.equal(readFrame(bytes([1], [7, 0, 0, 0], [0, 0, 0, 0, 0])), null);
  assert.equal(readFrame(bytes([3], [1, 0, 0, 0], [9, 0, 0, 0], [200, 0, 0, 0], [99])), null);
  assert.equal(readFrame(bytes([77], [0, 0, 0, 0, 0, 0, 0, 0])), null);
});

test("text that is no operation is no message", () => {
  assert.equal(readFrame("[1]"), null);
  assert.equal(readFrame("null"), null);
  assert.deepEqual(readFrame('{"op":"removeStatus","statusIds":["a"]}'), { op: "removeStatus", statusIds: ["a"] });
});

test("a request's frame has service, call and encoding", () => {
  const frame = callFrame(2, 3, "cdr", Uint8Array.of(8));
  assert.deepEqual([...frame], [2, 2, 0, 0, 0, 3, 0, 0, 0, 3, 0, 0, 0, 99, 100, 114, 8]);
});

test("a published message's frame has its channel", () => {
  assert.deepEqual([...messageFrame(258, Uint8Array.of(9))], [1, 2, 1, 0, 0, 9]);
});

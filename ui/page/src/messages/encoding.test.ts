import assert from "node:assert/strict";
import { test } from "node:test";
import { decoderOf } from "./decoding";
import { encoderOf } from "./encoding";

const TYPE = { encoding: "cdr", schemaName: "zoo_msgs/Name", schema: "string name\nstring[] others\nfloat64 age\nint64 id\n" };

function roundTrip(message: unknown): unknown {
  const bytes = encoderOf(TYPE).encode(message);
  const channel = { ...TYPE, id: 1, topic: "/zoo", schemaEncoding: "ros2msg" };
  return decoderOf(channel).decode(new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength));
}

test("texts beyond ASCII are written whole", () => {
  const message = { name: "grün", others: ["日本", "🤖!"], age: 1.5, id: 2n ** 60n };
  assert.deepEqual(roundTrip(message), message);
});

test("fields that are left out are zero or empty", () => {
  assert.deepEqual(roundTrip({}), { name: "", others: [], age: 0, id: 0n });
});

test("JSON keeps large integers", () => {
  const encoder = encoderOf({ encoding: "json", schemaName: "zoo", schema: '{"type":"object"}' });
  assert.equal(new TextDecoder().decode(encoder.encode({ id: 2n ** 63n })), '{"id":9223372036854775808}');
});

test("an encoding that is not written says so", () => {
  assert.throws(() => encoderOf({ ...TYPE, encoding: "protobuf" }), /zoo_msgs\/Name is encoded as protobuf/);
});

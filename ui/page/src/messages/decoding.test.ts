import assert from "node:assert/strict";
import test from "node:test";
import { MessageWriter } from "@foxglove/rosmsg2-serialization";
import type { Channel } from "../connection/protocol";
import { decoderOf, definitionsOf } from "./decoding";

const ZOO = `int64 large
uint64 counter
bool on
byte flags
float32[] gains
uint8[4] bytes
string word
builtin_interfaces/Duration wait
`;
const channel = (fields: Partial<Channel>): Channel => ({
  id: 1,
  topic: "/zoo",
  encoding: "cdr",
  schemaEncoding: "ros2msg",
  schemaName: "zoo_msgs/msg/Zoo",
  schema: ZOO,
  ...fields,
});

/** A message behind a frame's head of 13 bytes, as the WebSocket delivers it. */
function framed(payload: Uint8Array): DataView {
  const frame = new Uint8Array(13 + payload.length);
  frame.set(payload, 13);
  return new DataView(frame.buffer, 13);
}

test("each kind of field is decoded without loss", () => {
  const zoo = {
    large: -(2n ** 63n),
    counter: 2n ** 64n - 1n,
    on: true,
    flags: 200,
    gains: [0.5, -0.25],
    bytes: [1, 2, 3, 255],
    word: "green",
    wait: { sec: -1, nanosec: 5 },
  };
  const bytes = new MessageWriter(definitionsOf(ZOO)).writeMessage(zoo);
  const decoder = decoderOf(channel({}));
  const { gains, bytes: fixed, ...rest } = decoder.decode(framed(bytes)) as Record<string, unknown>;
  assert.deepEqual({ ...rest, gains: [...(gains as Float32Array)], bytes: [...(fixed as Uint8Array)] }, zoo);
  assert.equal(decoder.shape.type, "zoo_msgs/Zoo");
});

// JointState(header=Header(stamp=Time(sec=1795501652, nanosec=5), frame_id="grün"), name=["hip", "left_knee"], position=[0.25, -1.5])
const JOINT_STATE =
  "00010000542e056b05000000060000006772c3bc6e0000000200000004000000686970000a0000006c6566745f6b6e656500000002000000" +
  "00000000000000000000d03f000000000000f8bf0000000000000000";

test("a message is decoded as busflow encodes it", () => {
  const schema = "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n===\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n===\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
  const bytes = Uint8Array.from(JOINT_STATE.match(/../g)!, (pair) => parseInt(pair, 16));
  const message = decoderOf(channel({ schema })).decode(framed(bytes)) as { header: unknown; name: unknown; position: Float64Array };
  assert.deepEqual(message.header, { stamp: { sec: 1_795_501_652, nanosec: 5 }, frame_id: "grün" });
  assert.deepEqual(message.name, ["hip", "left_knee"]);
  assert.deepEqual([...message.position], [0.25, -1.5]);
});

test("JSON is decoded, its large integers too", () => {
  const decoder = decoderOf(channel({ encoding: "json", schemaEncoding: "jsonschema", schema: '{"type":"object"}' }));
  const data = framed(new TextEncoder().encode('{"n":9223372036854775807,"t":"<b>"}'));
  assert.deepEqual(decoder.decode(data), { n: 9223372036854775807n, t: "<b>" });
});

test("a channel that cannot be read says why", () => {
  assert.throws(() => decoderOf(channel({ encoding: "protobuf", schemaEncoding: "protobuf" })), /\/zoo is encoded as protobuf/);
  assert.throws(() => decoderOf(channel({ schemaEncoding: "ros2idl" })), /ros2idl/);
  assert.throws(() => decoderOf(channel({ schema: "float64 x y z" })), /the definition of \/zoo cannot be read/);
  assert.throws(() => decoderOf(channel({ encoding: "json", schema: "{" })), /the schema of \/zoo cannot be read/);
});

test("a message that does not fit says so", () => {
  const cut = framed(new MessageWriter(definitionsOf("string word\n")).writeMessage({ word: "long enough" }).subarray(0, 10));
  assert.throws(() => decoderOf(channel({ schema: "string word\n" })).decode(cut), /a message of \/zoo cannot be read/);
  const json = decoderOf(channel({ encoding: "json", schema: "" }));
  assert.throws(() => json.decode(framed(Uint8Array.of(0x22, 0xff, 0x22))), /a message of \/zoo cannot be read/);
});

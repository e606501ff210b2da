import assert from "node:assert/strict";
import { test, type TestContext } from "node:test";
import { decoderOf } from "../../messages/decoding";
import { Drive, stickOf, twistBytes, type Stick } from "./drive";

/** Lets periods of 50 ms pass one by one: a timer that sets the next one is due in the next. */
function pass(context: TestContext, periods: number): void {
  for (let period = 0; period < periods; period += 1) context.mock.timers.tick(50);
}

const AHEAD: Stick = { forward: 1, left: 0 };

test("it publishes only while it is held", (context) => {
  context.mock.timers.enable({ apis: ["setTimeout"] });
  const sent: number[] = [];
  const drive = new Drive(({ forward }) => sent.push(forward));
  pass(context, 20);
  assert.deepEqual(sent, []);
  drive.hold(AHEAD);
  pass(context, 2);
  assert.deepEqual(sent, [1, 1, 1]);
});

test("a release publishes zero at once and ends", (context) => {
  context.mock.timers.enable({ apis: ["setTimeout"] });
  const sent: number[] = [];
  const drive = new Drive(({ forward }) => sent.push(forward));
  drive.hold(AHEAD);
  drive.release();
  assert.deepEqual(sent, [1, 0]);
  assert.equal(drive.isHeld, false);
  pass(context, 20);
  assert.deepEqual(sent, [1, 0, 0, 0]);
});

test("a new hold after a release goes on", (context) => {
  context.mock.timers.enable({ apis: ["setTimeout"] });
  const sent: number[] = [];
  const drive = new Drive(({ forward }) => sent.push(forward));
  drive.hold(AHEAD);
  drive.release();
  drive.hold({ forward: 0.5, left: 0 });
  pass(context, 2);
  assert.deepEqual(sent.slice(-2), [0.5, 0.5]);
  assert.equal(drive.isHeld, true);
});

test("a second release publishes nothing more", (context) => {
  context.mock.timers.enable({ apis: ["setTimeout"] });
  const sent: number[] = [];
  const drive = new Drive(({ forward }) => sent.push(forward));
  drive.release();
  assert.deepEqual(sent, []);
});

test("an end publishes the zeros that are due at once", (context) => {
  context.mock.timers.enable({ apis: ["setTimeout"] });
  const sent: number[] = [];
  const drive = new Drive(({ forward }) => sent.push(forward));
  drive.hold(AHEAD);
  drive.end();
  assert.deepEqual(sent, [1, 0, 0, 0]);
  pass(context, 5);
  assert.equal(sent.length, 4);
});

test("the stick never goes beyond the greatest speed", (context) => {
  context.mock.timers.enable({ apis: ["setTimeout"] });
  const sent: Stick[] = [];
  const drive = new Drive((stick) => sent.push(stick));
  drive.hold({ forward: 7, left: Number.NaN });
  drive.release();
  assert.deepEqual(sent[0], { forward: 1, left: 0 });
  assert.deepEqual(stickOf(["KeyW", "ArrowUp", "KeyA"]), { forward: 1, left: 1 });
});

test("opposite keys cancel each other", () => {
  assert.deepEqual(stickOf(["ArrowUp", "ArrowDown"]), { forward: 0, left: 0 });
  assert.equal(stickOf(["KeyX"]), null);
});

test("the bytes are a Twist's", () => {
  const schema = "Vector3 linear\nVector3 angular\n===\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n";
  const type = { encoding: "cdr", schemaEncoding: "ros2msg", schemaName: "geometry_msgs/msg/Twist", schema };
  const bytes = twistBytes(0.5, -2);
  const twist = decoderOf({ id: 1, topic: "/cmd_vel", ...type }).decode(new DataView(bytes.buffer));
  assert.deepEqual(twist, { linear: { x: 0.5, y: 0, z: 0 }, angular: { x: 0, y: 0, z: -2 } });
});

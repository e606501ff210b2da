import assert from "node:assert/strict";
import test from "node:test";
import { pathText } from "./paths";
import { definitionsOf } from "./decoding";
import { numberOf, numbersOfMessage, numbersOfShape, shapeOfDefinitions, shapeOfJsonSchema, type Shape } from "./shapes";
import { unitAt } from "./units";

const IMU = `std_msgs/Header header
geometry_msgs/Vector3 linear_acceleration
float64[9] linear_acceleration_covariance
string[] notes
uint8 OK=1
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
`;

test("a definition gives the paths of its numbers", () => {
  const shape = shapeOfDefinitions("sensor_msgs/Imu", definitionsOf(IMU));
  assert.deepEqual(numbersOfShape(shape).map(pathText), [
    "header.stamp.sec",
    "header.stamp.nanosec",
    "linear_acceleration.x",
    "linear_acceleration.y",
    "linear_acceleration_covariance[0]",
  ]);
});

test("units come from the nearest known field", () => {
  const shape = shapeOfDefinitions("sensor_msgs/Imu", definitionsOf(IMU));
  assert.equal(unitAt(["linear_acceleration", "y"], shape), "m/s²");
  assert.equal(unitAt(["header", "stamp", "nanosec"], shape), "ns");
  assert.equal(unitAt(["linear_acceleration_covariance", 0], shape), undefined);
  const joints = shapeOfDefinitions("sensor_msgs/JointState", definitionsOf("string[] name\nfloat64[] position\n"));
  assert.equal(unitAt(["position", { named: "hip" }], joints), "rad");
});

test("definitions that use each other twice stay small", () => {
  const names = Array.from({ length: 16 }, (_, at) => String.fromCharCode(65 + at));
  const text = names.map((name, at) => `MSG: p/${name}\np/${names[at + 1] ?? "Q"}[] one\np/${names[at + 1] ?? "Q"}[] two\n`).join("===\n");
  const shape = shapeOfDefinitions("p/Root", definitionsOf(`p/A root\n===\n${text}===\nMSG: p/Q\nint8 x\n`));
  const count = (each: Shape): number => [...(each.fields?.values() ?? [])].reduce((sum, inner) => sum + count(inner), 1);
  assert.ok(count(shape) < 11_000, String(count(shape)));
  assert.ok(numbersOfShape(shape).length <= 2000);
});

test("a JSON Schema gives the paths of its numbers", () => {
  const shape = shapeOfJsonSchema({
    type: "object",
    properties: { mode: { type: "string" }, on: { type: "boolean" }, gains: { type: "array", items: { type: "object", properties: { "k p": { type: "number" } } } } },
  });
  assert.deepEqual(numbersOfShape(shape).map(pathText), ["on", 'gains[0]["k p"]']);
});

test("a message gives its numbers by name", () => {
  const joints = { name: ["hip", "knee"], position: new Float64Array(2), flags: [true], count: 3n, note: "" };
  assert.deepEqual(numbersOfMessage(joints).map(pathText), ["position[hip]", "position[knee]", "flags[0]", "count"]);
  assert.deepEqual(numbersOfMessage({ status: [{ name: "motor", level: 1 }] }).map(pathText), ["status[motor].level"]);
});

test("a long array offers its first items", () => {
  assert.equal(numbersOfMessage({ data: new Uint8Array(1_000_000) }).length, 64);
});

test("numbers, truth values and large integers are plotted", () => {
  assert.deepEqual([1.5, 2n ** 62n, true, false, "1", null, undefined, {}].map(numberOf), [1.5, 2 ** 62, 1, 0, undefined, undefined, undefined, undefined]);
});

import assert from "node:assert/strict";
import test from "node:test";
import { addressText, namesOf, parseAddress, parsePath, PathError, pathText, valueAt } from "./paths";

const JOINTS = { name: ["hip", "left knee"], position: new Float64Array([0.25, -1.5]), effort: [] };

test("a path is read as --field writes it", () => {
  assert.deepEqual(parsePath("linear_acceleration.y"), ["linear_acceleration", "y"]);
  assert.deepEqual(parsePath("points[0].x"), ["points", 0, "x"]);
  assert.deepEqual(parsePath("rows[ -1 ][2]"), ["rows", -1, 2]);
  assert.deepEqual(parsePath("position[left_knee_joint]"), ["position", { named: "left_knee_joint" }]);
});

test("the place of an error is given", () => {
  for (const [text, at] of [["", 0], [".x", 0], ["a..b", 2], ["a.[0]", 2], ["a b", 1], ["a[", 1], ["a[0]b", 4], ["0", 0], ['a["\\x"]', 1]] as const) {
    assert.throws(() => parsePath(text), (error) => error instanceof PathError && error.at === at, text);
  }
  assert.throws(() => parsePath("a".repeat(1001)), PathError);
  assert.throws(() => parseAddress("imu/data"), PathError);
  assert.throws(() => parseAddress("imu/data.a..b"), (error) => error instanceof PathError && error.at === 11);
});

test("an address is written as it was read", () => {
  for (const text of ["imu/data.linear_acceleration.y", "joint_states.position[hip]", 'joint_states.position["left knee"]', 'loose["odd key"].x']) {
    assert.equal(addressText(parseAddress(text)), text);
    assert.equal(addressText(parseAddress(`/${text}`)), text);
  }
  assert.equal(parseAddress("joint_states.position[0]").topic, "/joint_states");
});

test("any name survives as a step", () => {
  for (const named of ['a"b', "a]b", "\\", "1", "-1", " ", "ü", "a/b.c-d"]) {
    assert.deepEqual(parsePath(pathText(["values", { named }])), ["values", { named }]);
  }
});

test("a value is found by field, index and name", () => {
  assert.equal(valueAt(["position", 1], JOINTS), -1.5);
  assert.equal(valueAt(["position", -1], JOINTS), -1.5);
  assert.equal(valueAt(["position", { named: "left knee" }], JOINTS), -1.5);
  assert.equal(valueAt([{ named: "odd key" }], { "odd key": 3 }), 3);
  assert.equal(valueAt(["status", { named: "motor" }, "level"], { status: [{ name: "motor", level: 2 }] }), 2);
});

test("a transform bears the name of its child", () => {
  const message = { transforms: [{ child_frame_id: "pelvis", transform: { x: 1 } }, { child_frame_id: "imu_link", transform: { x: 2 } }] };
  assert.equal(valueAt(parsePath("transforms[imu_link].transform.x"), message), 2);
});

test("an item by name follows its name", () => {
  const path = parsePath("position[hip]");
  assert.equal(valueAt(path, { name: ["knee", "hip"], position: [1, 2] }), 2);
  assert.equal(valueAt(path, { name: ["hip", "knee"], position: [1, 2] }), 1);
});

test("what a message lacks is undefined", () => {
  for (const path of ["velocity", "position[2]", "position[-3]", "position[nose]", "effort[hip]", "position.x", "constructor", "name.length", "position[0].x"]) {
    assert.equal(valueAt(parsePath(path), JOINTS), undefined, path);
  }
  assert.equal(valueAt(["x"], null), undefined);
  assert.equal(valueAt(["x"], "text"), undefined);
});

test("names stand above a nested array too", () => {
  const trajectory = { joint_names: ["hip", "knee"], points: [{ positions: [1, 2], velocities: [3] }] };
  assert.equal(valueAt(parsePath("points[0].positions[knee]"), trajectory), 2);
  assert.equal(valueAt(parsePath("points[0].velocities[hip]"), trajectory), undefined);
  assert.equal(valueAt(parsePath("leg.position[hip]"), { name: ["hip"], leg: { name: ["hip"], position: [7] } }), 7);
  assert.equal(valueAt(parsePath("leg.position[foot]"), { name: ["foot"], leg: { name: ["hip"], position: [7] } }), undefined);
  assert.equal(namesOf(trajectory.joint_names, [trajectory]), undefined);
});

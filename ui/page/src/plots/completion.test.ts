import assert from "node:assert/strict";
import test from "node:test";
import { completions } from "./completion";

const FIELDS = [
  "imu/data.header.stamp.sec",
  "imu/data.linear_acceleration.x",
  "imu/data.linear_acceleration.y",
  "imu/data.linear_acceleration_covariance[0]",
  "joint_states.position[left_knee_joint]",
  "joint_states.velocity[left_knee_joint]",
  "unimu.x",
];

test("a joint is found by its name", () => {
  assert.deepEqual(completions("left_knee", FIELDS, 9), FIELDS.slice(4, 6));
  assert.deepEqual(completions("knee velo", FIELDS, 9), [FIELDS[5]]);
});

test("what begins with the text comes first", () => {
  assert.deepEqual(completions("/imu", FIELDS, 3), [FIELDS[1], FIELDS[2], FIELDS[6]]);
  assert.deepEqual(completions("ACC", FIELDS, 9), [FIELDS[1], FIELDS[2], FIELDS[3]]);
});

test("header and covariance come last", () => {
  assert.deepEqual(completions("", FIELDS, 9).slice(-2), [FIELDS[0], FIELDS[3]]);
});

test("no more than the most are offered", () => {
  assert.equal(completions("", FIELDS, 2).length, 2);
  assert.deepEqual(completions("nothing", FIELDS, 2), []);
});

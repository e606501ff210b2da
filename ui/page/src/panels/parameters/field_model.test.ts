import assert from "node:assert/strict";
import { test } from "node:test";
import type { Parameter, ParameterValue } from "../../connection/answers";
import { differenceOf, faultOf, fieldOf, grouped, niceStep, readText, textOf } from "./field_model";

const NO_BOUNDS = { minimum: null, maximum: null, exclusive_minimum: false, exclusive_maximum: false, step: null };

function parameter(fields: Partial<Parameter> = {}): Parameter {
  return {
    name: "rate_hz",
    type: "float",
    ros_type: 3,
    value: 10,
    default: 10,
    required: false,
    bounds: NO_BOUNDS,
    range: "",
    choices: null,
    description: "",
    read_only: false,
    source: "default",
    at: null,
    ...fields,
  };
}

const kindOf = (fields: Partial<Parameter>) => fieldOf(parameter(fields)).kind;

test("each declaration has its control", () => {
  assert.equal(kindOf({}), "number");
  assert.equal(kindOf({ bounds: { ...NO_BOUNDS, minimum: 0, maximum: 5 } }), "slider");
  assert.equal(kindOf({ bounds: { ...NO_BOUNDS, minimum: 0 } }), "number");
  assert.equal(kindOf({ type: "bool", value: true }), "switch");
  assert.equal(kindOf({ type: "Literal['a', 'b']", value: "a", choices: ["a", "b"] }), "choice");
  assert.equal(kindOf({ type: "str", value: "x" }), "text");
  assert.equal(kindOf({ type: "list[float]", value: [1, 2] }), "json");
});

test("a unit is the last word of the description", () => {
  const { unit, description } = fieldOf(parameter({ description: "Warn of a joint beyond this angle, rad." }));
  assert.deepEqual([unit, description], ["rad", "Warn of a joint beyond this angle."]);
  assert.equal(fieldOf(parameter({ description: "How often it publishes; 0 is off." })).unit, "");
  assert.equal(fieldOf(parameter({ description: "Gains, one of each joint." })).description, "Gains, one of each joint.");
});

test("a slider has steps that people count in", () => {
  assert.deepEqual([0.004, 0.05, 0.9, 5, 30].map(niceStep), [0.002, 0.05, 0.5, 5, 20]);
  assert.equal(fieldOf(parameter({ bounds: { ...NO_BOUNDS, minimum: 0, maximum: 1 } })).step, 0.005);
  assert.equal(fieldOf(parameter({ type: "int", bounds: { ...NO_BOUNDS, minimum: 0, maximum: 640 } })).step, 1);
});

test("a float shows its point, an integer none", () => {
  assert.equal(textOf(5, fieldOf(parameter())), "5.0");
  assert.equal(textOf(5, fieldOf(parameter({ type: "int" }))), "5");
  assert.equal(textOf([1, 2], fieldOf(parameter({ type: "list[int]", value: [1] }))), "[1,2]");
  assert.equal(textOf(null, fieldOf(parameter())), "");
});

test("what is no number is refused before it is sent", () => {
  assert.deepEqual(readText(" 2.5 ", fieldOf(parameter())), { value: 2.5 });
  assert.deepEqual(readText("fast", fieldOf(parameter())), { error: "fast is no number." });
  assert.deepEqual(readText("2.5", fieldOf(parameter({ type: "int" }))), { error: "2.5 is no whole number." });
  assert.deepEqual(readText("", fieldOf(parameter())), { error: "Nothing is no number." });
  assert.deepEqual(readText(".inf", fieldOf(parameter())), { value: ".inf" });
});

test("an optional number may be empty", () => {
  assert.deepEqual(readText("", fieldOf(parameter({ default: null, value: null }))), { value: null });
});

test("choices keep their type", () => {
  const field = fieldOf(parameter({ type: "Literal[1, 2]", value: 1, choices: [1, 2] }));
  assert.deepEqual(readText("2", field), { value: 2 });
});

test("lists are written as JSON", () => {
  const field = fieldOf(parameter({ type: "list[float]", value: [1] }));
  assert.deepEqual(readText("[1, 2.5]", field), { value: [1, 2.5] });
  assert.ok("error" in readText("1, 2", field));
});

test("what differs from the file is known by its value", () => {
  assert.equal(differenceOf(parameter({ file_value: 10 })), null);
  assert.equal(differenceOf(parameter({ value: 12, file_value: 10 })), "10.0 in the file");
  const frames = (each: object): ParameterValue => ({ base_link: { camera: each } }) as unknown as ParameterValue;
  assert.equal(differenceOf(parameter({ value: frames({ xyz: [1, 0, 0], rpy: null }), file_value: frames({ xyz: [1, 0, 0] }) })), null);
  assert.equal(differenceOf(parameter({ source: "set at run time" })), "set at run time");
  assert.equal(differenceOf(parameter({ source: "set at run time", file_value: 10 })), null);
});

test("a refusal names its reason and what to do", () => {
  const faults = [
    { path: ["other"], message: "other is wrong", fix: null },
    { path: ["noise", "imu"], message: "noise.imu must be at least 0, got -3", fix: "allowed: at least 0" },
  ];
  assert.equal(faultOf(faults, "noise.imu"), "noise.imu must be at least 0, got -3 (allowed: at least 0)");
  assert.equal(faultOf(faults, "rate_hz"), "other is wrong");
  assert.equal(faultOf([], "rate_hz"), null);
});

test("dotted names are grouped", () => {
  const rows = ["rate", "noise.imu", "noise.joints"].map((name) => parameter({ name }));
  assert.deepEqual(grouped(rows).map(([group, members]) => [group, members.length]), [["", 1], ["noise", 2]]);
});

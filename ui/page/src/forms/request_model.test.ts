import assert from "node:assert/strict";
import { test } from "node:test";
import { definitionsOf } from "../messages/decoding";
import { shapeOfDefinitions, shapeOfJsonSchema } from "../messages/shapes";
import { answerLines } from "./answer_text";
import { requestFields, requestOf } from "./request_model";

const SCHEMA = `geometry_msgs/Point goal
bool fast
uint64 id
float64[] gains
string name
===
MSG: geometry_msgs/Point
float64 x
float64 y
`;
const FIELDS = requestFields(shapeOfDefinitions("zoo/srv/Go_Request", definitionsOf(SCHEMA)));

test("a request has a field for each leaf of its type", () => {
  assert.deepEqual(
    FIELDS.map(({ path, kind, type }) => [path.join("."), kind, type]),
    [
      ["goal.x", "number", "float64"],
      ["goal.y", "number", "float64"],
      ["fast", "switch", "bool"],
      ["id", "integer", "uint64"],
      ["gains", "json", "float64[]"],
      ["name", "text", "string"],
    ],
  );
});

test("a request of ROS 2 without fields has none", () => {
  const shape = shapeOfDefinitions("std_srvs/srv/Trigger_Request", definitionsOf("uint8 structure_needs_at_least_one_member\n"));
  assert.deepEqual(requestFields(shape), []);
});

test("a JSON Schema gives fields too", () => {
  const shape = shapeOfJsonSchema({ type: "object", properties: { on: { type: "boolean" }, n: { type: "integer" } } });
  assert.deepEqual(requestFields(shape).map(({ kind }) => kind), ["switch", "integer"]);
});

test("texts become values of their types", () => {
  const texts = new Map([
    ["goal.x", "1.5"],
    ["fast", "true"],
    ["id", "18446744073709551615"],
    ["gains", "[1, 2]"],
    ["name", "true"],
  ]);
  assert.deepEqual(requestOf(FIELDS, texts), {
    message: { goal: { x: 1.5 }, fast: true, id: 18446744073709551615n, gains: [1, 2], name: "true" },
  });
});

test("a field that is wrong says so", () => {
  const built = requestOf(FIELDS, new Map([["goal.x", "far"], ["id", "1.5"], ["gains", "1 2"]]));
  assert.ok("errors" in built);
  assert.deepEqual([...built.errors.keys()], ["goal.x", "id", "gains"]);
  assert.equal(built.errors.get("id"), "1.5 is no whole number.");
});

test("an empty field has the default of its type", () => {
  const shape = shapeOfDefinitions("zoo/action/Go_Goal", definitionsOf("float64 speed 0.5\nbool fast true\nint32[] steps [1, 2]\nstring name\n"));
  const usual = { speed: 0.5, fast: true, steps: [1, 2] };
  assert.deepEqual(requestOf(requestFields(shape), new Map()), { message: usual });
  assert.deepEqual(requestOf(requestFields(shape), new Map([["speed", "2"], ["fast", "false"]])), { message: { ...usual, speed: 2, fast: false } });
  const schema = { type: "object", properties: { on: { type: "boolean", default: true } } };
  assert.deepEqual(requestOf(requestFields(shapeOfJsonSchema(schema)), new Map()), { message: { on: true } });
});

test("an infinite number can be written", () => {
  assert.deepEqual(requestOf(FIELDS, new Map([["goal.x", "-.inf"]])), { message: { goal: { x: -Infinity } } });
});

test("an answer is written line by line", () => {
  const answer = { success: true, values: [{ name: "<b>" }], raw: Float64Array.of(1, 2), text: "a\nb" };
  assert.deepEqual(answerLines(answer), ["success: true", "values:", "  -", "    name: <b>", "raw: [1, 2]", 'text: "a\\nb"']);
});

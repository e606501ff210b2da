import assert from "node:assert/strict";
import { test } from "node:test";
import type { ParameterRow } from "../connection/protocol";
import { fieldOf } from "../panels/parameters/field_model";
import { parameterOf, ServerParameters } from "./server_parameters";

const ROWS: readonly ParameterRow[] = [
  { name: "/camera.exposure.auto", value: true },
  { name: "/camera.gain", value: 5, type: "float64" },
  { name: "/arm.joints", value: ["hip", "knee"] },
];

/** A server that answers each request with `answer`, and what was asked of it. */
function served(answer: (asked: { op: string; id: string; parameters?: ParameterRow[] }, parameters: ServerParameters) => void) {
  const asked: unknown[] = [];
  const parameters: ServerParameters = new ServerParameters({
    send: (operation) => {
      const { id, ...rest } = operation;
      asked.push(rest);
      answer({ ...(rest as { op: string }), id: String(id) }, parameters);
    },
  });
  return { parameters, asked };
}

test("a form is made from the values", () => {
  const kinds = [true, 3, 2.5, "a", [1], undefined].map((value) => fieldOf(parameterOf({ name: "/a.b", ...(value === undefined ? {} : { value }) })).kind);
  assert.deepEqual(kinds, ["switch", "number", "number", "text", "json", "json"]);
  assert.equal(parameterOf({ name: "/a.b", value: 5, type: "float64" }).type, "float");
  assert.equal(parameterOf({ name: "/a.b", value: "AAA=", type: "byte_array" }).read_only, true);
  assert.equal(parameterOf({ name: "/a.b.c", value: 1 }).name, "b.c");
});

test("parameters are read node by node", async () => {
  const { parameters, asked } = served(({ id }, to) => to.handle({ op: "parameterValues", parameters: ROWS, id }));
  await parameters.readAll();
  assert.deepEqual(parameters.nodes.value, ["/arm", "/camera"]);
  assert.deepEqual((await parameters.read("/camera")).map(({ name, value }) => [name, value]), [["exposure.auto", true], ["gain", 5]]);
  assert.deepEqual(asked.at(-1), { op: "getParameters", parameterNames: ["/camera.exposure.auto", "/camera.gain"] });
  parameters.ended();
  assert.deepEqual(parameters.nodes.value, []);
});

test("a value is set with its type", async () => {
  const { parameters, asked } = served(({ id, parameters: set }, to) => to.handle({ op: "parameterValues", parameters: set ?? ROWS, id }));
  await parameters.readAll();
  assert.equal(await parameters.set("/camera", "gain", 7), null);
  assert.deepEqual(asked.at(-1), { op: "setParameters", parameters: [{ name: "/camera.gain", value: 7, type: "float64" }] });
});

test("a refusal has the server's words", async () => {
  const { parameters } = served((_, to) => to.handle({ op: "status", level: 2, message: "too large" }));
  await assert.rejects(parameters.set("/camera", "gain", 7), new Error("too large"));
  const silent = served(({ id }, to) => to.handle({ op: "parameterValues", parameters: [{ name: "/camera.gain", value: 5 }], id }));
  assert.equal(await silent.parameters.set("/camera", "gain", 7), "The server keeps 5.");
});

test("a server that does not answer is said", async (context) => {
  context.mock.timers.enable({ apis: ["setTimeout"] });
  const asking = served(() => undefined).parameters.readAll();
  context.mock.timers.tick(10_000);
  await assert.rejects(asking, new Error("No answer within 10 s."));
});

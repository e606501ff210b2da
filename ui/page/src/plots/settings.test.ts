import assert from "node:assert/strict";
import test from "node:test";
import { shownIn, withPlot, type Layout } from "../shell/layout";
import { linesOf, linesOfField, withLine, withoutLine } from "./settings";

test("settings from an address are checked", () => {
  assert.deepEqual(linesOf({ lines: ["a.x", 5, null, "a.x", "b.y"] }), ["a.x", "b.y"]);
  assert.deepEqual(linesOf({ lines: "a.x" }), []);
  assert.equal(linesOf({ lines: Array.from({ length: 99 }, (_, at) => `a.x[${at}]`) }).length, 50);
});

test("lines come and go, each once", () => {
  const settings = withLine(withLine(withLine({ other: 1 }, "a.x"), "b.y"), "a.x");
  assert.deepEqual(settings, { other: 1, lines: ["a.x", "b.y"] });
  assert.deepEqual(withoutLine(settings, "a.x"), { other: 1, lines: ["b.y"] });
});

test("a field is plotted where a plot stands", () => {
  const layout: Layout = { view: "messages", views: {} };
  const one = withPlot(layout, "a.x");
  assert.deepEqual(shownIn(one), [[{ kind: "messages", settings: {} }], [{ kind: "plot", settings: { lines: ["a.x"] } }]]);
  assert.deepEqual(shownIn(withPlot(one, "b.y"))[1], [{ kind: "plot", settings: { lines: ["a.x", "b.y"] } }]);
});

test("a full view takes no more plots", () => {
  const places = Array.from({ length: 12 }, () => ({ kind: "messages", settings: {} }));
  const layout: Layout = { view: "messages", views: { messages: [places] } };
  assert.deepEqual(withPlot(layout, "a.x"), layout);
});

test("an element plots several fields of a topic", () => {
  assert.deepEqual(linesOfField("/imu/data", " linear_acceleration.x  position[hip] "), ["/imu/data.linear_acceleration.x", "/imu/data.position[hip]"]);
});

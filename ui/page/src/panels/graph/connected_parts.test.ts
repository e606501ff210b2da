import assert from "node:assert/strict";
import { test } from "node:test";
import { chain, graph, node } from "../../testing/graphs";
import { connectedParts, pack } from "./connected_parts";
import { graphModel } from "./model";

const SHOWN = { services: false, hidden: false };

test("parts that no edge connects are split", () => {
  const of = chain();
  const all = { ...of, nodes: [...of.nodes, node("/alone")] };
  const parts = connectedParts(graphModel(all, new Map(), { ...SHOWN, grouping: "none" }));
  assert.deepEqual(parts.map(({ vertices, edges }) => [vertices.length, edges.length]), [[3, 2], [1, 0]]);
});

test("members of a group stay together", () => {
  const all = graph({ nodes: [node("/left/a"), node("/left/b"), node("/c")] });
  const parts = connectedParts(graphModel(all, new Map(), { ...SHOWN, grouping: "namespace" }));
  assert.deepEqual(parts.map(({ vertices }) => vertices.map(({ name }) => name)), [["/left/a", "/left/b"], ["/c"]]);
});

test("packed boxes do not overlap, and fill the screen", () => {
  const boxes = Array.from({ length: 20 }, () => ({ width: 200, height: 100 }));
  const { places, size } = pack(boxes, { width: 1000, height: 400 });
  assert.deepEqual(size, { width: 1000, height: 400 });
  assert.equal(new Set(places.map(({ x, y }) => `${x} ${y}`)).size, 20);
});

test("low boxes stand below each other beside a high one", () => {
  const low = Array.from({ length: 4 }, () => ({ width: 100, height: 50 }));
  const { places, size } = pack([{ width: 100, height: 200 }, ...low], { width: 200, height: 200 });
  assert.deepEqual(size, { width: 200, height: 200 });
  assert.deepEqual(places.slice(1).map(({ x, y }) => [x, y]), [0, 50, 100, 150].map((y) => [100, y]));
});

import assert from "node:assert/strict";
import { test } from "node:test";
import { chain, graph, node, publisher, subscription, topic } from "../../testing/graphs";
import type { Box } from "./geometry";
import { bestLayout, layoutOf, structureOf, type Measure } from "./layout";
import { graphModel, type Grouping } from "./model";
import { middleOf, pathOf } from "./route";
import type { Graph } from "../../connection/answers";

const measure: Measure = (label) => label.length * 8;
const model = (of: Graph, grouping: Grouping = "none") =>
  graphModel(of, new Map(), { grouping, services: false, hidden: false });

function overlap(one: Box, other: Box): boolean {
  const isApart =
    one.x + one.width <= other.x ||
    other.x + other.width <= one.x ||
    one.y + one.height <= other.y ||
    other.y + other.height <= one.y;
  return !isApart;
}

/** A graph of layers: each node receives two topics of the layer before, and publishes one. */
function layered(width: number, depth: number): Graph {
  const name = (layer: number, place: number) => `/ns_${place % 5}/node_${layer}_${place}`;
  const places = Array.from({ length: width }, (_, place) => place);
  const layers = Array.from({ length: depth }, (_, layer) => layer);
  return graph({
    nodes: layers.flatMap((layer) => places.map((place) => node(name(layer, place)))),
    topics: layers.flatMap((layer) =>
      places.map((place) =>
        topic(`/topic_${layer}_${place}`, {
          publishers: [publisher(name(layer, place))],
          subscriptions:
            layer + 1 < depth
              ? [subscription(name(layer + 1, place)), subscription(name(layer + 1, (place + 1) % width))]
              : [],
        }),
      ),
    ),
  });
}

test("messages flow from left to right", () => {
  const { vertices } = layoutOf(model(chain()), measure, "right");
  const [imu, data, filter] = ["node /imu", "topic /data", "node /filter"].map((id) => vertices.get(id)!);
  assert.ok(imu!.x + imu!.width < data!.x && data!.x + data!.width < filter!.x);
});

test("or from top to bottom", () => {
  const { vertices } = layoutOf(model(chain()), measure, "down");
  assert.ok(vertices.get("node /imu")!.y < vertices.get("topic /data")!.y);
});

test("rates and drops change no structure", () => {
  const before = model(chain());
  const after = model(chain({ dropped: 5, delivered: 100 }));
  assert.equal(structureOf(before), structureOf(after));
  assert.notEqual(structureOf(before), structureOf(model(graph({ nodes: [node("/imu")] }))));
});

test("the same structure gives the same layout", () => {
  const of = layered(6, 4);
  const again = { ...of, nodes: [...of.nodes].reverse(), topics: [...of.topics].reverse() };
  assert.deepEqual(layoutOf(model(of), measure, "right"), layoutOf(model(again), measure, "right"));
});

test("a hundred nodes do not overlap, nor leave the drawing", () => {
  const { vertices, size } = bestLayout(model(layered(20, 5), "none"), measure, { width: 900, height: 700 });
  const boxes = [...vertices.values()];
  assert.equal(boxes.length, 200);
  boxes.forEach((box, index) => {
    assert.ok(box.x >= 0 && box.y >= 0 && box.x + box.width <= size.width && box.y + box.height <= size.height);
    assert.ok(!boxes.slice(index + 1).some((other) => overlap(box, other)));
  });
});

test("a frame holds all members of its group", () => {
  const of = model(layered(5, 3), "namespace");
  const { vertices, groups } = layoutOf(of, measure, "right");
  for (const { id, group } of of.vertices) {
    if (group === null) continue;
    const [box, frame] = [vertices.get(id)!, groups.get(group)!];
    assert.ok(box.x >= frame.x && box.y >= frame.y, id);
    assert.ok(box.x + box.width <= frame.x + frame.width && box.y + box.height <= frame.y + frame.height, id);
  }
});

test("the direction fits the screen", () => {
  const of = model(layered(1, 6));
  assert.equal(bestLayout(of, measure, { width: 1600, height: 500 }).flow, "right");
  assert.equal(bestLayout(of, measure, { width: 380, height: 900 }).flow, "down");
});

test("parts that nothing connects stand side by side", () => {
  const two = graph({ nodes: ["/a", "/b", "/c", "/d", "/e", "/f"].map((name) => node(name)) });
  const { size } = bestLayout(model(two), measure, { width: 900, height: 600 });
  assert.ok(size.width / size.height > 0.7 && size.width / size.height < 4, JSON.stringify(size));
});

test("an edge begins and ends at the sides of its boxes", () => {
  const { vertices, edges } = layoutOf(model(chain()), measure, "right");
  const { points } = edges.get("publish /imu /data")!;
  assert.equal(points.length, 2);
  const [imu, data] = [vertices.get("node /imu")!, vertices.get("topic /data")!];
  assert.deepEqual(points[0], { x: imu.x + imu.width, y: imu.y + imu.height / 2 });
  assert.deepEqual(points.at(-1), { x: data.x, y: data.y + data.height / 2 });
});

test("a path begins and ends at the first and last point", () => {
  const points = [{ x: 0, y: 0 }, { x: 40, y: 50 }, { x: 100, y: 20 }];
  const straight = [points[0]!, points[2]!];
  assert.match(pathOf({ points, isArc: false }, "right"), /^M0 0C.* 100 20$/);
  assert.equal(pathOf({ points: straight, isArc: false }, "right"), "M0 0C50 0 50 20 100 20");
  assert.equal(pathOf({ points: straight, isArc: true }, "right"), "M0 0C0 32 100 52 100 20");
  assert.equal(pathOf({ points: [], isArc: false }, "right"), "");
  assert.deepEqual(middleOf({ points, isArc: false }, "right"), { x: 40, y: 50 });
});

test("an edge back to its neighbour takes another way", () => {
  const own = graph({
    nodes: [node("/a")],
    topics: [topic("/t", { publishers: [publisher("/a")], subscriptions: [subscription("/a")] })],
  });
  for (const flow of ["right", "down"] as const) {
    const { edges } = layoutOf(model(own), measure, flow);
    const middles = [...edges.values()].map((route) => middleOf(route, flow));
    assert.equal(middles.length, 2);
    assert.ok(Math.hypot(middles[0]!.x - middles[1]!.x, middles[0]!.y - middles[1]!.y) > 20, JSON.stringify(middles));
  }
});

test("an edge against the layers is drawn too", () => {
  const loop = graph({
    nodes: [node("/a"), node("/b")],
    topics: [
      topic("/there", { publishers: [publisher("/a")], subscriptions: [subscription("/b")] }),
      topic("/back", { publishers: [publisher("/b")], subscriptions: [subscription("/a")] }),
    ],
  });
  const { edges } = layoutOf(model(loop), measure, "right");
  assert.equal(edges.size, 4);
  for (const { points } of edges.values()) assert.ok(points.length >= 2);
});

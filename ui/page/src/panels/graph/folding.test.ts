import assert from "node:assert/strict";
import { test } from "node:test";
import { publishKey, deliverKey } from "../../store/rates";
import { graph, node, publisher, subscription, topic } from "../../testing/graphs";
import { folded, foldedGroups } from "./folding";
import { beginningOf, layoutOf } from "./layout";
import { graphModel, type GraphModel } from "./model";
import { readable } from "./viewport";

const SHOWN = { grouping: "namespace", services: false, hidden: false } as const;

/** Robots with nodes each, in a chain within the robot; the last of each publishes what one node receives. */
function fleet(robots: number, each: number): GraphModel {
  const names = (robot: number): string[] => Array.from({ length: each }, (_, at) => `/robot_${robot}/stage_${at}`);
  const all = Array.from({ length: robots }, (_, robot) => names(robot));
  const topics = all.flatMap((own, robot) =>
    own.map((name, at) =>
      topic(`/robot_${robot}/value_${at}`, {
        publishers: [publisher(name)],
        subscriptions: [subscription(own[at + 1] ?? "/overview", { dropped: at === 1 ? 3 : at === each - 1 ? 2 : 0 })],
      }),
    ),
  );
  const nodes = [...all.flat().map((name) => node(name)), node("/overview")];
  const rates = new Map(
    topics.flatMap(({ name, publishers, subscriptions }): [string, number][] => [
      [publishKey(name, publishers[0]!.node), 10],
      [deliverKey(name, subscriptions[0]!.node), 10],
    ]),
  );
  return graphModel(graph({ nodes, topics }), rates, SHOWN);
}

test("a folded group is one vertex with its edges outward", () => {
  const model = folded(fleet(2, 3), new Set(["/robot_0"]));
  const group = model.vertices.find(({ kind }) => kind === "group")!;
  assert.deepEqual([group.label, group.detail, group.tone], ["/robot_0", "3 nodes, 3 topics", "good"]);
  const [bundle] = model.edges.filter(({ kind }) => kind === "bundle");
  assert.deepEqual([bundle!.from, bundle!.to, bundle!.rateHz, bundle!.label], ["group /robot_0", "node /overview", 10, "2 dropped"]);
  assert.ok(model.vertices.some(({ id }) => id === "node /robot_1/stage_0"));
  assert.ok(!model.vertices.some(({ id }) => id === "node /robot_0/stage_0"));
});

test("a small graph is folded only by hand", () => {
  const model = fleet(2, 3);
  assert.deepEqual([...foldedGroups(model, new Set(), null)], []);
  assert.deepEqual([...foldedGroups(model, new Set(["/robot_1"]), null)], ["/robot_1"]);
});

test("a large graph is folded until it is opened", () => {
  const model = fleet(10, 10);
  assert.equal(foldedGroups(model, new Set(), null).size, 10);
  assert.ok(!foldedGroups(model, new Set(["/robot_3"]), null).has("/robot_3"));
});

test("what is selected is never folded away", () => {
  const model = fleet(10, 10);
  assert.ok(!foldedGroups(model, new Set(), "node /robot_4/stage_2").has("/robot_4"));
  assert.ok(!foldedGroups(model, new Set(), "deliver /robot_5/stage_1 /robot_5/value_0").has("/robot_5"));
});

test("names of a hundred nodes are readable at once", () => {
  const screen = { width: 960, height: 640 };
  const measure = (label: string) => label.length * 7.5;
  const whole = fleet(10, 10);
  for (const model of [whole, folded(whole, foldedGroups(whole, new Set(), null))]) {
    const layout = layoutOf(model, measure, "right");
    const { scale } = readable(layout.size, screen, beginningOf(layout));
    assert.ok(scale * 12 >= 10, `${scale * 12} px`);
  }
  const layout = layoutOf(folded(whole, foldedGroups(whole, new Set(), null)), measure, "right");
  assert.ok(readable(layout.size, screen, beginningOf(layout)).scale * layout.size.height <= screen.height, "folded it is seen whole");
});

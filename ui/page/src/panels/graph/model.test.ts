import assert from "node:assert/strict";
import { test } from "node:test";
import { deliverKey, dropKey, publishKey } from "../../store/rates";
import { chain, graph, node, publisher, service, subscription, topic } from "../../testing/graphs";
import { edgeWidth, goalsText, graphModel, topicRate, usefulGroupings, type Shown } from "./model";

const USUAL: Shown = { grouping: "none", services: false, hidden: false };
const NO_RATES = new Map<string, number>();

test("nodes and topics are joined in the way of the messages", () => {
  const { vertices, edges } = graphModel(chain(), NO_RATES, USUAL);
  assert.deepEqual(vertices.map(({ id }) => id), ["node /filter", "node /imu", "topic /data"]);
  assert.deepEqual(
    edges.map(({ from, to }) => `${from} > ${to}`),
    ["topic /data > node /filter", "node /imu > topic /data"],
  );
});

test("an edge without messages is silent", () => {
  const rates = new Map([[publishKey("/data", "/imu"), 0]]);
  const [deliver, publish] = graphModel(chain(), rates, USUAL).edges;
  assert.deepEqual([publish!.look, publish!.width, publish!.label], ["silent", 1, null]);
  assert.match(publish!.sentence, /\/imu publishes \/data, silent/);
  assert.equal(deliver!.look, "silent");
});

test("an edge is as wide as its rate", () => {
  const widths = [0, 1, 10, 100, 1000, 1e9].map(edgeWidth);
  assert.deepEqual([...widths].sort((one, other) => one - other), widths);
  assert.equal(widths[0], 1);
  assert.ok(widths[2]! - widths[1]! > 0.8, String(widths));
  assert.equal(widths[5], 7);
  assert.equal(edgeWidth(null), 1);
});

test("drops make an edge dashed and name their number", () => {
  const rates = new Map([
    [deliverKey("/data", "/filter"), 50],
    [dropKey("/data", "/filter"), 2],
  ]);
  const deliver = graphModel(chain({ dropped: 1200 }), rates, USUAL).edges[0]!;
  assert.deepEqual([deliver.look, deliver.label], ["dropping", "1\u202f200 dropped"]);
  assert.match(deliver.sentence, /50 Hz, 1\u202f200 dropped/);
});

test("drops that have ended are still shown", () => {
  const deliver = graphModel(chain({ dropped: 3 }), NO_RATES, USUAL).edges[0]!;
  assert.deepEqual([deliver.look, deliver.label], ["dropping", "3 dropped"]);
  assert.match(deliver.sentence, /3 dropped, none now$/);
});

test("two ends of one node are one edge", () => {
  const two = graph({
    nodes: [node("/a")],
    topics: [topic("/t", { subscriptions: [subscription("/a", { dropped: 1 }), subscription("/a", { dropped: 2 })] })],
  });
  const { edges } = graphModel(two, NO_RATES, USUAL);
  assert.deepEqual(edges.map(({ label }) => label), ["3 dropped"]);
});

test("what is hidden and what every node has is left out", () => {
  const ends = { publishers: [publisher("/a"), publisher("/_b")] };
  const all = graph({
    nodes: [node("/a"), node("/_b", { hidden: true })],
    topics: [topic("/t", ends), topic("/rosout", ends), topic("/_ticks", { ...ends, hidden: true })],
  });
  const names = (shown: Shown) => graphModel(all, NO_RATES, shown).vertices.map(({ name }) => name);
  assert.deepEqual(names(USUAL), ["/a", "/t"]);
  assert.deepEqual(graphModel(all, NO_RATES, USUAL).edges.map(({ from }) => from), ["node /a"]);
  assert.deepEqual(names({ ...USUAL, hidden: true }), ["/_b", "/a", "/_ticks", "/rosout", "/t"]);
});

test("topics of hidden nodes alone are not drawn", () => {
  const all = graph({ nodes: [node("/_b", { hidden: true })], topics: [topic("/t", { publishers: [publisher("/_b")] })] });
  assert.deepEqual(graphModel(all, NO_RATES, USUAL).vertices, []);
});

test("services are drawn on request, from client to server", () => {
  const all = graph({
    nodes: [node("/client"), node("/server")],
    services: [service("/reset", { servers: [{ node: "/server" }], clients: [{ node: "/client" }] })],
  });
  assert.equal(graphModel(all, NO_RATES, USUAL).edges.length, 0);
  assert.deepEqual(
    graphModel(all, NO_RATES, { ...USUAL, services: true }).edges.map(({ from, to }) => `${from} > ${to}`),
    ["node /client > service /reset", "service /reset > node /server"],
  );
});

test("actions are drawn with services, with the goals that run", () => {
  const servers = [{ node: "/arm", received: 3, running: 1, succeeded: 2 }];
  const all = graph({
    nodes: [node("/arm"), node("/boss")],
    services: [service("/arm/move", { type: "lab/action/Move", is_action: true, servers, clients: [{ node: "/boss" }] })],
  });
  assert.equal(graphModel(all, NO_RATES, USUAL).vertices.length, 2);
  const { vertices, edges } = graphModel(all, NO_RATES, { ...USUAL, services: true });
  assert.deepEqual(
    edges.map(({ from, to, sentence }) => [from, to, sentence]),
    [
      ["node /boss", "action /arm/move", "/boss sends goals to /arm/move"],
      ["action /arm/move", "node /arm", "/arm serves /arm/move"],
    ],
  );
  const [action] = vertices;
  assert.deepEqual([action!.id, action!.detail], ["action /arm/move", "1 running"]);
  assert.equal(action!.sentence, "action /arm/move, lab/action/Move, 1 running");
});

test("the goals of an end are told apart by what became of them", () => {
  assert.equal(goalsText({ node: "/arm", received: 1200, running: 0, succeeded: 1190, aborted: 10 }), "1\u202f200 goals, 1\u202f190 succeeded, 10 aborted");
  assert.equal(goalsText({ node: "/boss", called: 1, running: 0, lost: 1 }), "1 goal, 1 lost");
  assert.equal(goalsText({ node: "/reset", received: 4 }), "");
  assert.equal(goalsText({ node: "/ros" }), "");
});

test("a topic stands with those who publish it", () => {
  const all = graph({
    nodes: [node("/left/joints"), node("/merger")],
    topics: [
      topic("/left/states", { publishers: [publisher("/left/joints")], subscriptions: [subscription("/merger")] }),
      topic("/both", { publishers: [publisher("/left/joints"), publisher("/merger")] }),
    ],
  });
  const { vertices } = graphModel(all, NO_RATES, { ...USUAL, grouping: "namespace" });
  const groups = Object.fromEntries(vertices.map(({ label, group }) => [label, group]));
  assert.deepEqual(groups, { joints: "/left", "/merger": null, states: "/left", "/both": null });
});

test("a long name is drawn without its middle", () => {
  const long = `/arm/${"joint_".repeat(10)}left`;
  const { vertices } = graphModel(graph({ nodes: [node(long)] }), NO_RATES, USUAL);
  assert.deepEqual(vertices.map(({ label, name }) => [label, name]), [["/arm/joint_joint_joi…int_joint_joint_left", long]]);
});

test("only groupings with several groups are offered", () => {
  const nodes = [node("/a", { process: "one" }), node("/b", { process: "two" })];
  assert.deepEqual(usefulGroupings(nodes), ["process"]);
});

test("another program's end has no ledger and no drops", () => {
  const { edges } = graphModel(chain({ delivered: null, dropped: null, queued: null }), NO_RATES, USUAL);
  assert.deepEqual(edges.map(({ look }) => look), ["silent", "silent"]);
});

test("a topic's rate is that of all its publishers", () => {
  const two = topic("/t", { publishers: [publisher("/a"), publisher("/b")], rate_hz: 7 });
  assert.equal(topicRate(two, new Map([[publishKey("/t", "/a"), 10], [publishKey("/t", "/b"), 5]])), 15);
  assert.equal(topicRate(two, NO_RATES), 7);
});

test("a recorded edge has the rate of its topic", () => {
  const nodes = [node("/imu"), node("/other")];
  const publishers = [publisher("/imu", { published: null })];
  const recorded = graph({ nodes, topics: [topic("/data", { rate_hz: 50, publishers })] });
  assert.deepEqual(
    graphModel(recorded, new Map(), USUAL).edges.map(({ look, sentence }) => [look, sentence]),
    [["flowing", "/imu publishes /data, 50 Hz"]],
  );
  const shared = graph({ nodes, topics: [topic("/data", { rate_hz: 50, publishers: [...publishers, publisher("/other", { published: null })] })] });
  assert.deepEqual(
    graphModel(shared, new Map(), USUAL).edges.map(({ sentence }) => sentence),
    ["/imu publishes /data with others, 50 Hz", "/other publishes /data with others, 50 Hz"],
  );
});

import assert from "node:assert/strict";
import { test } from "node:test";
import type { Channel } from "../connection/protocol";
import { ConnectionGraph } from "./connection_graph";

const CHANNELS = new Map<string, Channel>([
  ["/scan", { id: 1, topic: "/scan", encoding: "cdr", schemaName: "sensor_msgs/msg/LaserScan", schema: "" }],
]);

function known(): ConnectionGraph {
  const found = new ConnectionGraph();
  found.update({
    publishedTopics: [{ name: "/scan", publisherIds: ["/arm/lidar"] }],
    subscribedTopics: [{ name: "/scan", subscriberIds: ["/mapper", "/_foxglove"] }],
    advertisedServices: [
      { name: "/mapper/save", providerIds: ["/mapper"] },
      { name: "/mapper/get_parameters", providerIds: ["/mapper"] },
    ],
  });
  return found;
}

test("another server's graph has its nodes and topics", () => {
  const { nodes, topics, services } = known().graph(CHANNELS);
  assert.deepEqual(nodes.map(({ name, namespace, hidden }) => [name, namespace, hidden]), [
    ["/_foxglove", "/", true],
    ["/arm/lidar", "/arm", false],
    ["/mapper", "/", false],
  ]);
  assert.deepEqual(topics.map(({ name, type }) => [name, type]), [["/scan", "sensor_msgs/msg/LaserScan"]]);
  assert.deepEqual(topics[0]!.subscriptions.map(({ node, dropped }) => [node, dropped]), [["/mapper", null], ["/_foxglove", null]]);
  assert.deepEqual(services.map(({ name, hidden }) => [name, hidden]), [["/mapper/save", false], ["/mapper/get_parameters", true]]);
});

test("an action of another server is known by the service of its goals", () => {
  const found = new ConnectionGraph();
  const names = ["/arm/move/_action/send_goal", "/arm/move/_action/get_result", "/_own/_action/send_goal"];
  found.update({ advertisedServices: names.map((name) => ({ name, providerIds: ["/arm"] })) });
  assert.deepEqual(
    found.graph(CHANNELS).services.map(({ name, is_action, hidden }) => [name, is_action, hidden]),
    [
      ["/arm/move", true, false],
      ["/arm/move/_action/get_result", false, true],
      ["/_own", true, true],
    ],
  );
});

test("what is removed is gone, and what changes is replaced", () => {
  const found = known();
  found.update({ subscribedTopics: [{ name: "/scan", subscriberIds: ["/planner"] }], removedServices: ["/mapper/save", "/mapper/get_parameters"] });
  assert.deepEqual(found.graph(CHANNELS).nodes.map(({ name }) => name), ["/arm/lidar", "/planner"]);
  found.update({ removedTopics: ["/scan"] });
  assert.deepEqual(found.graph(CHANNELS), { elapsed_s: null, nodes: [], topics: [], services: [] });
});

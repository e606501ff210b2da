/** Graphs for tests: small answers of the question `graph`, of which a test states what it is about. */
import type { Graph, GraphNode, GraphService, GraphTopic, TopicPublisher, TopicSubscription } from "../connection/answers";

const QOS = { reliability: "reliable", durability: "volatile", depth: 10 };

export function node(name: string, fields: Partial<GraphNode> = {}): GraphNode {
  return {
    name,
    namespace: name.slice(0, name.lastIndexOf("/")) || "/",
    process: "main",
    machine: null,
    pid: 1,
    state: "running",
    plugin: "a_plugin",
    source: null,
    restarts: 0,
    failures: [],
    stopped_by_hand: 0,
    depends_on: [],
    is_busflow: true,
    hidden: false,
    timers: [],
    publishers: [],
    subscriptions: [],
    services: [],
    clients: [],
    ...fields,
  };
}

export function publisher(name: string, fields: Partial<TopicPublisher> = {}): TopicPublisher {
  return { node: name, qos: QOS, published: 0, origin: null, ...fields };
}

export function subscription(name: string, fields: Partial<TopicSubscription> = {}): TopicSubscription {
  const counts = { published: 0, delivered: 0, dropped: 0, queued: 0, deadlines_missed: 0 };
  return { node: name, qos: QOS, origin: null, depth: 10, overflow: "drop_oldest", reasons: {}, ...counts, ...fields };
}

export function topic(name: string, fields: Partial<GraphTopic> = {}): GraphTopic {
  return {
    name,
    type: "std_msgs/msg/Float64",
    hidden: false,
    external: false,
    published: 0,
    rate_hz: null,
    publishers: [],
    subscriptions: [],
    losses: {},
    ...fields,
  };
}

export function service(name: string, fields: Partial<GraphService> = {}): GraphService {
  return { name, type: "std_srvs/srv/Trigger", is_action: false, hidden: false, servers: [], clients: [], ...fields };
}

export function graph(fields: Partial<Graph> = {}): Graph {
  return { elapsed_s: 1, nodes: [], topics: [], services: [], ...fields };
}

/** A chain: `/imu` publishes `/data`, which `/filter` receives. */
export function chain(end: Partial<TopicSubscription> = {}): Graph {
  return graph({
    nodes: [node("/imu"), node("/filter")],
    topics: [topic("/data", { publishers: [publisher("/imu")], subscriptions: [subscription("/filter", end)] })],
  });
}

/** Connection graph: nodes, topics and services as a server of Foxglove's protocol names them, such as ROS 2's foxglove_bridge. */
import type { Graph, GraphNode, GraphService, GraphTopic, Qos } from "../connection/answers";
import type { Channel, ConnectionGraphUpdate } from "../connection/protocol";
import { namespaceOf } from "./text";

/** Nodes by the name of the topic or service. */
type NodesByName = Map<string, readonly string[]>;

/** What is not known of another server's ends. */
const NO_QOS: Qos = { reliability: "", durability: "" };
const NO_COUNTS = { published: null, delivered: null, dropped: null, queued: null, deadlines_missed: null, depth: null, overflow: null };
const HIDDEN = /(^|\/)_/;
/** Services that each node of ROS 2 has. */
const OF_PARAMETERS = /\/(describe_parameters|get_parameters|get_parameter_types|list_parameters|set_parameters|set_parameters_atomically|get_type_description)$/;

/** Ending of the service by which ROS 2's graph names an action. */
const SEND_GOAL = "/_action/send_goal";

export class ConnectionGraph {
  readonly #published: NodesByName = new Map();
  readonly #subscribed: NodesByName = new Map();
  readonly #services: NodesByName = new Map();

  /** Returns another object of the same nodes. */
  copy(): ConnectionGraph {
    const other = new ConnectionGraph();
    for (const [from, to] of [
      [this.#published, other.#published],
      [this.#subscribed, other.#subscribed],
      [this.#services, other.#services],
    ] as const) {
      for (const [name, nodes] of from) to.set(name, nodes);
    }
    return other;
  }

  clear(): void {
    for (const each of [this.#published, this.#subscribed, this.#services]) each.clear();
  }

  update(update: ConnectionGraphUpdate): void {
    for (const { name, publisherIds } of update.publishedTopics ?? []) this.#published.set(name, publisherIds);
    for (const { name, subscriberIds } of update.subscribedTopics ?? []) this.#subscribed.set(name, subscriberIds);
    for (const { name, providerIds } of update.advertisedServices ?? []) this.#services.set(name, providerIds);
    for (const name of update.removedTopics ?? []) {
      this.#published.delete(name);
      this.#subscribed.delete(name);
    }
    for (const name of update.removedServices ?? []) this.#services.delete(name);
  }

  /** Returns the graph in the form of a run's; types are those of the offered channels. */
  graph(channels: ReadonlyMap<string, Channel>): Graph {
    const topics = [...new Set([...this.#published.keys(), ...this.#subscribed.keys()])].sort().map((name) => this.#topic(name, channels));
    const services = [...this.#services].map(([name, nodes]) => serviceOf(name, nodes));
    const names = new Set([...this.#published.values(), ...this.#subscribed.values(), ...this.#services.values()].flat());
    return { elapsed_s: null, nodes: [...names].sort().map((name) => this.#node(name)), topics, services };
  }

  #topic(name: string, channels: ReadonlyMap<string, Channel>): GraphTopic {
    const unknown = { qos: NO_QOS, origin: null };
    return {
      name,
      type: channels.get(name)?.schemaName ?? "",
      hidden: HIDDEN.test(name),
      external: true,
      published: 0,
      rate_hz: null,
      publishers: (this.#published.get(name) ?? []).map((node) => ({ node, published: null, ...unknown })),
      subscriptions: (this.#subscribed.get(name) ?? []).map((node) => ({ node, reasons: {}, ...NO_COUNTS, ...unknown })),
      losses: {},
    };
  }

  #node(name: string): GraphNode {
    const of = (found: NodesByName): string[] => [...found].flatMap(([each, nodes]) => (nodes.includes(name) ? each : []));
    return {
      name,
      namespace: namespaceOf(name),
      ...{ process: null, machine: null, pid: null, plugin: null, source: null },
      state: "",
      ...{ restarts: 0, stopped_by_hand: 0, failures: [], depends_on: [], timers: [], clients: [] },
      is_busflow: false,
      hidden: HIDDEN.test(name),
      publishers: of(this.#published),
      subscriptions: of(this.#subscribed),
      services: of(this.#services),
    };
  }
}

function serviceOf(name: string, nodes: readonly string[]): GraphService {
  const action = name.endsWith(SEND_GOAL) ? name.slice(0, -SEND_GOAL.length) : null;
  const hidden = OF_PARAMETERS.test(name) || HIDDEN.test(action ?? name);
  return { name: action ?? name, type: "", is_action: action !== null, hidden, servers: nodes.map((node) => ({ node })), clients: [] };
}

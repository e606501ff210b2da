/** The graph as it is drawn: vertices and edges with their looks, from the run's answer. Pure. */
import type { Graph, GraphNode, GraphService, GraphTopic, ServiceEnd } from "../../connection/answers";
import { deliverKey, dropKey, publishKey, type RateTable } from "../../store/rates";
import { counted, countText, rateText } from "../../store/text";

/** A group is a vertex where it is folded. */
export type VertexKind = "node" | "topic" | "service" | "action" | "group";
/** How a vertex stands: each has a sign of its own beside its colour. */
export type Tone = "good" | "waiting" | "stopped" | "bad" | "none";
export type Grouping = "none" | "namespace" | "process" | "machine";
/** A bundle is what goes to or from a folded group. */
export type EdgeKind = "publish" | "deliver" | "call" | "serve" | "bundle";
/** How an edge looks: grey and thin, as wide as its rate, or red, dashed and labelled. */
export type EdgeLook = "silent" | "flowing" | "dropping";

export interface Vertex {
  readonly id: string;
  readonly kind: VertexKind;
  readonly name: string;
  /** The name as it is drawn. */
  readonly label: string;
  /** What stands beside or below the name: a node's state, a topic's rate. */
  readonly detail: string;
  readonly tone: Tone;
  readonly group: string | null;
  /** What a screen reader says: what is drawn, word for word, and more. */
  readonly sentence: string;
}

export interface Edge {
  readonly id: string;
  readonly kind: EdgeKind;
  readonly from: string;
  readonly to: string;
  readonly node: string;
  /** The topic or service at its other end. */
  readonly name: string;
  readonly look: EdgeLook;
  readonly rateHz: number | null;
  readonly dropped: number;
  readonly width: number;
  readonly label: string | null;
  readonly sentence: string;
}

export interface GraphModel {
  readonly vertices: readonly Vertex[];
  readonly edges: readonly Edge[];
}

export interface Shown {
  readonly grouping: Grouping;
  readonly services: boolean;
  readonly hidden: boolean;
}

export const vertexId = (kind: VertexKind, name: string): string => `${kind} ${name}`;
export const edgeId = (kind: EdgeKind, node: string, name: string): string => `${kind} ${node} ${name}`;

const TONES: Readonly<Record<string, Tone>> = {
  running: "good",
  built: "waiting",
  waiting: "waiting",
  starting: "waiting",
  restarting: "waiting",
  stopping: "stopped",
  stopped: "stopped",
  "stopped by hand": "stopped",
  failed: "bad",
};
/** Topics that every node has: they say nothing of this graph. */
const COMMON_TOPICS: ReadonlySet<string> = new Set(["/parameter_events", "/rosout"]);
const GOAL_ENDS = ["running", "queued", "succeeded", "canceled", "aborted", "rejected", "left", "lost"] as const;
/** Characters from which on a name is drawn without its middle: the end tells it from its neighbours. */
const LONGEST_LABEL = 40;
const THINNEST = 1;
const WIDEST = 7;

/** Returns an edge's width in pixels: 1 when silent, and 1.4 more for each tenfold of its rate, at most 7. */
export function edgeWidth(rateHz: number | null): number {
  if (rateHz === null || rateHz <= 0) return THINNEST;
  return Math.min(WIDEST, THINNEST + 0.5 + 1.4 * Math.log10(1 + rateHz));
}

/** Returns how an edge looks; drops stay to be seen, also once they have ended. */
export function edgeLook(rateHz: number | null, dropped: number): EdgeLook {
  return dropped > 0 ? "dropping" : rateHz === null || rateHz <= 0 ? "silent" : "flowing";
}

/** Returns what is drawn of a graph; vertices and edges in the order of their names, so that a layout repeats. */
export function graphModel(graph: Graph, rates: RateTable, shown: Shown): GraphModel {
  const nodes = graph.nodes.filter((node) => shown.hidden || !node.hidden);
  const groups = new Map(nodes.map((node) => [node.name, groupOf(node, shown.grouping)]));
  const isShown = (node: string): boolean => groups.has(node);
  const topics = graph.topics
    .filter((topic) => shown.hidden || !isHidden(topic))
    .filter((topic) => [...topic.publishers, ...topic.subscriptions].some((end) => isShown(end.node)));
  const services = shown.services ? graph.services.filter((service) => shown.hidden || !service.hidden) : [];
  const edges = [
    ...topics.flatMap((topic) => topicEdges(topic, rates)),
    ...services.flatMap((service) => serviceEdges(service)),
  ].filter((edge) => isShown(edge.node));
  const vertices = [
    ...nodes.map((node) => nodeVertex(node, groups.get(node.name) ?? null)),
    ...topics.map((topic) => topicVertex(topic, rates, commonGroup(homeOf(topic), groups))),
    ...services.map((service) => serviceVertex(service, commonGroup(service.servers.map((end) => end.node), groups))),
  ];
  const byId = (one: { id: string }, other: { id: string }) => (one.id < other.id ? -1 : Number(one.id > other.id));
  return { vertices: vertices.sort(byId), edges: edges.sort(byId) };
}

/** Returns the groupings that would show more than one group. */
export function usefulGroupings(nodes: readonly GraphNode[]): readonly Grouping[] {
  const seen = nodes.filter((node) => !node.hidden);
  const all: readonly Grouping[] = ["namespace", "process", "machine"];
  return all.filter((grouping) => new Set(seen.map((node) => groupOf(node, grouping))).size > 1);
}

/** Returns the rate at which a topic is published, over all its publishers; null where it is not known. */
export function topicRate(topic: GraphTopic, rates: RateTable): number | null {
  const known = topic.publishers.flatMap(({ node }) => rates.get(publishKey(topic.name, node)) ?? []);
  return known.length > 0 ? known.reduce((sum, rate) => sum + rate, 0) : topic.rate_hz;
}

/** Returns the rate at which a node publishes a topic; that of the topic where its publishers are not told apart, as in a recording. */
export function publishRate(topic: GraphTopic, node: string, rates: RateTable): number | null {
  return rates.get(publishKey(topic.name, node)) ?? topic.rate_hz;
}

export function serviceKind(service: GraphService): "service" | "action" {
  return service.is_action ? "action" : "service";
}

/** Returns what became of the goals at an end of an action, or an empty text where nothing is known of them. */
export function goalsText(end: ServiceEnd): string {
  const goals = end.received ?? end.called;
  if (goals === undefined || end.running === undefined) return "";
  const ends = GOAL_ENDS.flatMap((word) => (end[word] ?? 0) > 0 ? `${countText(end[word] ?? 0)} ${word}` : []);
  return [counted(goals, "goal"), ...ends].join(", ");
}

export function isHidden(topic: GraphTopic): boolean {
  return topic.hidden || COMMON_TOPICS.has(topic.name);
}

export function toneOf(state: string): Tone {
  return TONES[state] ?? "none";
}

function groupOf(node: GraphNode, grouping: Grouping): string | null {
  switch (grouping) {
    case "none":
      return null;
    case "namespace":
      return node.namespace === "/" ? null : node.namespace;
    case "process":
      return node.process;
    case "machine":
      return node.machine;
  }
}

/** Returns the group of all these nodes, or null where they are in several. */
function commonGroup(nodes: readonly string[], groups: ReadonlyMap<string, string | null>): string | null {
  const found = new Set(nodes.filter((node) => groups.has(node)).map((node) => groups.get(node) ?? null));
  const [only] = found;
  return found.size === 1 ? (only ?? null) : null;
}

/** Returns a name as it is drawn: without the namespace that its group's frame already says, and without its middle where it is long. */
function labelOf(group: string | null, name: string): string {
  const own = group !== null && name.startsWith(`${group}/`) ? name.slice(group.length + 1) : name;
  return own.length <= LONGEST_LABEL ? own : `${own.slice(0, LONGEST_LABEL / 2)}…${own.slice(-LONGEST_LABEL / 2)}`;
}

/** Returns the nodes by which a topic is grouped: those that publish it, or else those that receive it. */
function homeOf(topic: GraphTopic): readonly string[] {
  return (topic.publishers.length > 0 ? topic.publishers : topic.subscriptions).map((end) => end.node);
}

function nodeVertex(node: GraphNode, group: string | null): Vertex {
  const restarts = node.restarts > 0 ? `, ${counted(node.restarts, "restart")}` : "";
  return {
    id: vertexId("node", node.name),
    kind: "node",
    name: node.name,
    label: labelOf(group, node.name),
    detail: node.state,
    tone: toneOf(node.state),
    group,
    sentence: `node ${node.name} ${node.state}${restarts}`,
  };
}

function topicVertex(topic: GraphTopic, rates: RateTable, group: string | null): Vertex {
  const rate = topicRate(topic, rates);
  const detail = rate === null ? "" : rateText(rate);
  return {
    id: vertexId("topic", topic.name),
    kind: "topic",
    name: topic.name,
    label: labelOf(group, topic.name),
    detail,
    tone: "none",
    group,
    sentence: `topic ${topic.name} ${detail}, ${topic.type}`,
  };
}

function serviceVertex(service: GraphService, group: string | null): Vertex {
  const kind = serviceKind(service);
  const running = service.servers.reduce((sum, end) => sum + (end.running ?? 0), 0);
  const detail = service.is_action && running > 0 ? `${countText(running)} running` : "";
  return {
    id: vertexId(kind, service.name),
    kind,
    name: service.name,
    label: labelOf(group, service.name),
    detail,
    tone: "none",
    group,
    sentence: `${kind} ${service.name}, ${service.type}${detail === "" ? "" : `, ${detail}`}`,
  };
}

function topicEdges(topic: GraphTopic, rates: RateTable): Edge[] {
  const id = vertexId("topic", topic.name);
  const publishers = [...new Set(topic.publishers.map((end) => end.node))];
  const receivers = [...new Set(topic.subscriptions.map((end) => end.node))];
  const { name } = topic;
  return [
    ...publishers.map((node) => {
      const rate = publishRate(topic, node, rates);
      const others = publishers.length > 1 && !rates.has(publishKey(name, node)) ? " with others" : "";
      const ends: Ends = { kind: "publish", from: vertexId("node", node), to: id, node, name };
      return edge(ends, { rate, dropped: 0, isDropping: false }, `${node} publishes ${name}${others}`);
    }),
    ...receivers.map((node) => {
      const own = topic.subscriptions.filter((end) => end.node === node);
      const traffic: Traffic = {
        rate: rates.get(deliverKey(name, node)) ?? null,
        dropped: own.reduce((sum, end) => sum + (end.dropped ?? 0), 0),
        isDropping: (rates.get(dropKey(name, node)) ?? 0) > 0,
      };
      const ends: Ends = { kind: "deliver", from: id, to: vertexId("node", node), node, name };
      return edge(ends, traffic, `${node} receives ${name}`);
    }),
  ];
}

type Ends = Pick<Edge, "kind" | "from" | "to" | "node" | "name">;

interface Traffic {
  readonly rate: number | null;
  readonly dropped: number;
  /** Whether messages were dropped within the last seconds. */
  readonly isDropping: boolean;
}

function edge(ends: Ends, { rate, dropped, isDropping }: Traffic, sentence: string): Edge {
  const look = edgeLook(rate, dropped);
  const label = dropped > 0 ? counted(dropped, "dropped", "dropped") : null;
  const said = rate === null ? "" : rate > 0 ? `, ${rateText(rate)}` : ", silent";
  return {
    id: edgeId(ends.kind, ends.node, ends.name),
    ...ends,
    look,
    rateHz: rate,
    dropped,
    width: look === "dropping" ? Math.max(2, edgeWidth(rate)) : edgeWidth(rate),
    label,
    sentence: `${sentence}${said}${label === null ? "" : `, ${label}${isDropping ? "" : ", none now"}`}`,
  };
}

function serviceEdges(service: GraphService): Edge[] {
  const id = vertexId(serviceKind(service), service.name);
  const [asks, answers] = service.is_action ? ["sends goals to", "serves"] : ["calls", "answers"];
  const of = (ends: Ends, sentence: string): Edge => ({
    id: edgeId(ends.kind, ends.node, ends.name),
    ...ends,
    look: "flowing",
    rateHz: null,
    dropped: 0,
    width: THINNEST,
    label: null,
    sentence,
  });
  const servers = [...new Set(service.servers.map((end) => end.node))];
  const clients = [...new Set(service.clients.map((end) => end.node))];
  const { name } = service;
  return [
    ...clients.map((node) =>
      of({ kind: "call", from: vertexId("node", node), to: id, node, name }, `${node} ${asks} ${name}`),
    ),
    ...servers.map((node) =>
      of({ kind: "serve", from: id, to: vertexId("node", node), node, name }, `${node} ${answers} ${name}`),
    ),
  ];
}

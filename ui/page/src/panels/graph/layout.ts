/** The layout: where each vertex, edge and group stands, in layers. Pure but for the measured text. */
import { Graph, layout as dagreLayout } from "@dagrejs/dagre";
import { connectedParts, pack } from "./connected_parts";
import type { Box, Point, Size } from "./geometry";
import { vertexId, type GraphModel, type Vertex } from "./model";
import { attached, type Flow, type Route } from "./route";
import { fit } from "./viewport";

export interface Layout {
  readonly flow: Flow;
  readonly vertices: ReadonlyMap<string, Box>;
  readonly edges: ReadonlyMap<string, Route>;
  readonly groups: ReadonlyMap<string, Box>;
  readonly size: Size;
}

/** Returns the width of a vertex's label in pixels. */
export type Measure = (label: string, kind: Vertex["kind"]) => number;

const CARD_HEIGHT = 44;
const SERVICE_HEIGHT = 28;
/** Least width of a card: room for a state or a rate, which change while the layout stays. */
const LEAST_WIDTH = 104;
/** The same of a folded group, whose numbers of nodes and topics stand there. */
const LEAST_GROUP_WIDTH = 164;
const PADDING = 12;
const GROUP_LABEL = 22;
const MARGIN = 24;
/** Room between layers: side by side, the label of an edge has to fit in. */
const LAYER_GAPS: Readonly<Record<Flow, number>> = { right: 64, down: 48 };

/** Returns what a layout depends on: while this text stays the same, nothing moves. */
export function structureOf(model: GraphModel): string {
  const vertices = model.vertices.map(({ id, group }) => `${id}\t${group ?? ""}`);
  return [...vertices, "", ...model.edges.map(({ id }) => id)].join("\n");
}

/** Returns the layout that is seen largest on a screen; from left to right where that is nearly as good. */
export function bestLayout(model: GraphModel, measure: Measure, screen: Size): Layout {
  const parts = connectedParts(model);
  const [right, down] = (["right", "down"] as const).map((flow) =>
    joined(
      parts.map((part) => layoutOf(part, measure, flow)),
      flow,
      screen,
    ),
  ) as [Layout, Layout];
  return fit(right.size, screen).scale >= 0.85 * fit(down.size, screen).scale ? right : down;
}

/** Returns the layouts of connected parts as one. */
function joined(parts: readonly Layout[], flow: Flow, screen: Size): Layout {
  const { places, size } = pack(
    parts.map((part) => part.size),
    screen,
  );
  const [vertices, edges, groups] = [new Map<string, Box>(), new Map<string, Route>(), new Map<string, Box>()];
  parts.forEach((part, index) => {
    const { x, y } = places[index] ?? { x: 0, y: 0 };
    const moved = <Place extends Point>(place: Place): Place => ({ ...place, x: place.x + x, y: place.y + y });
    for (const [id, box] of part.vertices) vertices.set(id, moved(box));
    for (const [id, route] of part.edges) edges.set(id, { ...route, points: route.points.map(moved) });
    for (const [name, box] of part.groups) groups.set(name, moved(box));
  });
  return { flow, vertices, edges, groups, size };
}

export function layoutOf(model: GraphModel, measure: Measure, flow: Flow): Layout {
  const graph = new Graph({ compound: true, multigraph: true });
  const rankdir = flow === "right" ? "LR" : "TB";
  graph.setGraph({ rankdir, nodesep: 16, edgesep: 12, ranksep: LAYER_GAPS[flow], marginx: MARGIN, marginy: MARGIN });
  graph.setDefaultEdgeLabel(() => ({}));
  for (const vertex of model.vertices) graph.setNode(vertex.id, sizeOf(vertex, measure));
  for (const vertex of model.vertices) {
    if (vertex.group === null) continue;
    const group = vertexId("group", vertex.group);
    if (!graph.hasNode(group)) graph.setNode(group, {});
    graph.setParent(vertex.id, group);
  }
  for (const edge of model.edges) graph.setEdge(edge.from, edge.to, {}, edge.id);
  dagreLayout(graph);
  return read(graph, model, flow);
}

function sizeOf({ label, kind }: Vertex, measure: Measure): Size {
  const width = Math.ceil(measure(label, kind)) + 2 * PADDING;
  if (kind === "service") return { width, height: SERVICE_HEIGHT };
  return { width: Math.max(kind === "group" ? LEAST_GROUP_WIDTH : LEAST_WIDTH, width), height: CARD_HEIGHT };
}

function read(graph: Graph, model: GraphModel, flow: Flow): Layout {
  const boxOf = (id: string): Box => {
    const { x, y, width, height } = graph.node(id) as Box; // whose point is the middle
    return { x: x - width / 2, y: y - height / 2, width, height };
  };
  const placed = new Map(model.vertices.map(({ id }) => [id, boxOf(id)]));
  const vertices = flow === "right" ? aligned(placed) : placed;
  const groups = groupBoxes(model.vertices, vertices);
  const edges = new Map(
    model.edges.map((edge) => {
      const { points } = graph.edge(edge.from, edge.to, edge.id) as { points: readonly Point[] };
      return [edge.id, attached(edge, points, vertices, flow)];
    }),
  );
  return { flow, vertices, edges, groups, size: bounds([...vertices.values(), ...groups.values()]) };
}

/** Returns the boxes of each layer as wide as its widest, so that their sides stand in line. */
function aligned(boxes: ReadonlyMap<string, Box>): ReadonlyMap<string, Box> {
  const layerOf = ({ x, width }: Box): number => Math.round(x + width / 2);
  const widest = new Map<number, number>();
  for (const box of boxes.values()) widest.set(layerOf(box), Math.max(widest.get(layerOf(box)) ?? 0, box.width));
  return new Map(
    [...boxes].map(([id, box]) => {
      const width = widest.get(layerOf(box)) ?? box.width;
      return [id, { ...box, x: box.x - (width - box.width) / 2, width }];
    }),
  );
}

/** Returns a box around the vertices of each group, with room for its name. */
function groupBoxes(vertices: readonly Vertex[], boxes: ReadonlyMap<string, Box>): ReadonlyMap<string, Box> {
  const groups = new Map<string, Box>();
  for (const { id, group } of vertices) {
    const box = boxes.get(id);
    if (group === null || box === undefined) continue;
    const wide = { x: box.x - PADDING, y: box.y - GROUP_LABEL, width: box.width + 2 * PADDING, height: 0 };
    const padded = { ...wide, height: box.height + GROUP_LABEL + PADDING };
    const before = groups.get(group);
    groups.set(group, before === undefined ? padded : around(before, padded));
  }
  return groups;
}

function around(one: Box, other: Box): Box {
  const [x, y] = [Math.min(one.x, other.x), Math.min(one.y, other.y)];
  const right = Math.max(one.x + one.width, other.x + other.width);
  const bottom = Math.max(one.y + one.height, other.y + other.height);
  return { x, y, width: right - x, height: bottom - y };
}

function bounds(boxes: readonly Box[]): Size {
  const right = Math.max(0, ...boxes.map((box) => box.x + box.width));
  const bottom = Math.max(0, ...boxes.map((box) => box.y + box.height));
  return { width: right + MARGIN, height: bottom + MARGIN };
}

/** Returns the box where the flow begins. */
export function beginningOf({ flow, vertices }: Layout): Box {
  const wayTo = ({ x, y }: Box): number => (flow === "right" ? x : y);
  const nearer = (one: Box, other: Box): Box => (wayTo(other) < wayTo(one) ? other : one);
  return [...vertices.values()].reduce(nearer, { x: Infinity, y: Infinity, width: 0, height: 0 });
}

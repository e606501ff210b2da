/** The layout: where each vertex, edge and group stands, from left to right in layers. Pure but for the measured text. */
import { Graph, layout as dagreLayout } from "@dagrejs/dagre";
import type { Edge, GraphModel, Vertex } from "./model";

export interface Point {
  readonly x: number;
  readonly y: number;
}

export interface Box {
  /** Left upper corner. */
  readonly x: number;
  readonly y: number;
  readonly width: number;
  readonly height: number;
}

export interface Layout {
  readonly vertices: ReadonlyMap<string, Box>;
  /** The points through which each edge goes, from its start to its end. */
  readonly edges: ReadonlyMap<string, readonly Point[]>;
  readonly groups: ReadonlyMap<string, Box>;
  readonly size: { readonly width: number; readonly height: number };
}

/** Returns the width of a vertex's label in pixels. */
export type Measure = (label: string, kind: Vertex["kind"]) => number;

const NODE_HEIGHT = 44;
const TOPIC_HEIGHT = 28;
/** Room for a rate, which changes while the layout stays. */
const RATE_WIDTH = 62;
const PADDING = 12;
const GROUP_LABEL = 22;
const MARGIN = 24;

/** Returns what a layout depends on: while this text stays the same, nothing moves. */
export function structureOf(model: GraphModel): string {
  const vertices = model.vertices.map(({ id, group }) => `${id}\t${group ?? ""}`);
  return [...vertices, "", ...model.edges.map(({ id }) => id)].join("\n");
}

export function layoutOf(model: GraphModel, measure: Measure): Layout {
  const graph = new Graph({ compound: true, multigraph: true });
  graph.setGraph({ rankdir: "LR", nodesep: 18, edgesep: 14, ranksep: 64, marginx: MARGIN, marginy: MARGIN });
  graph.setDefaultEdgeLabel(() => ({}));
  for (const vertex of model.vertices) graph.setNode(vertex.id, sizeOf(vertex, measure));
  for (const vertex of model.vertices) {
    if (vertex.group === null) continue;
    const group = groupId(vertex.group);
    if (!graph.hasNode(group)) graph.setNode(group, {});
    graph.setParent(vertex.id, group);
  }
  for (const edge of model.edges) graph.setEdge(edge.from, edge.to, {}, edge.id);
  dagreLayout(graph);
  return read(graph, model);
}

const groupId = (group: string): string => `group ${group}`;

function sizeOf({ label, kind }: Vertex, measure: Measure): { width: number; height: number } {
  const width = Math.ceil(measure(label, kind)) + 2 * PADDING;
  if (kind === "node") return { width: Math.max(132, width + 4), height: NODE_HEIGHT };
  return { width: width + (kind === "topic" ? RATE_WIDTH : 0), height: TOPIC_HEIGHT };
}

interface Placed {
  readonly x: number;
  readonly y: number;
  readonly width: number;
  readonly height: number;
}

function read(graph: Graph, model: GraphModel): Layout {
  const boxOf = (id: string): Box => {
    const { x, y, width, height } = graph.node(id) as Placed;
    return { x: x - width / 2, y: y - height / 2, width, height };
  };
  const vertices = aligned(new Map(model.vertices.map(({ id }) => [id, boxOf(id)])));
  const groups = groupBoxes(model.vertices, vertices);
  const edges = new Map(
    model.edges.map((edge) => {
      const { points } = graph.edge(edge.from, edge.to, edge.id) as { points: readonly Point[] };
      return [edge.id, attached(edge, points, vertices)];
    }),
  );
  return { vertices, edges, groups, ...bounds([...vertices.values(), ...groups.values()]) };
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

function bounds(boxes: readonly Box[]): Pick<Layout, "size"> {
  const right = Math.max(0, ...boxes.map((box) => box.x + box.width));
  const bottom = Math.max(0, ...boxes.map((box) => box.y + box.height));
  return { size: { width: right + MARGIN, height: bottom + MARGIN } };
}

/** Returns an edge's points with its ends at the middle of the sides that face each other. */
function attached(edge: Edge, points: readonly Point[], boxes: ReadonlyMap<string, Box>): readonly Point[] {
  const [from, to] = [boxes.get(edge.from), boxes.get(edge.to)];
  if (from === undefined || to === undefined || points.length < 2) return points;
  const start = { x: from.x + from.width, y: from.y + from.height / 2 };
  const end = { x: to.x, y: to.y + to.height / 2 };
  // An edge that goes back, against the layers, keeps the ends that the layout gave it.
  if (end.x < start.x) return points;
  // Between neighbouring layers there is one point, which would only bend the curve.
  return points.length <= 3 ? [start, end] : [start, ...points.slice(1, -1), end];
}

/** Returns the path of an edge as SVG's `d`: an S-curve from each point to the next. */
export function pathOf(points: readonly Point[]): string {
  const [first, ...rest] = points;
  if (first === undefined) return "";
  let path = `M${round(first.x)} ${round(first.y)}`;
  let before = first;
  for (const point of rest) {
    const middle = round((before.x + point.x) / 2);
    path += `C${middle} ${round(before.y)} ${middle} ${round(point.y)} ${round(point.x)} ${round(point.y)}`;
    before = point;
  }
  return path;
}

/** Returns the point half way along an edge's points, where its label stands. */
export function middleOf(points: readonly Point[]): Point {
  const place = (points.length - 1) / 2;
  const [one, other] = [points[Math.floor(place)], points[Math.ceil(place)]];
  if (one === undefined || other === undefined) return { x: 0, y: 0 };
  return { x: (one.x + other.x) / 2, y: (one.y + other.y) / 2 };
}

const round = (value: number): number => Math.round(value * 10) / 10;

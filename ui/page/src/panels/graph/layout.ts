/** The layout: where each vertex, edge and group stands, in layers. Pure but for the measured text. */
import { Graph, layout as dagreLayout } from "@dagrejs/dagre";
import { connectedParts, pack } from "./connected_parts";
import type { Edge, GraphModel, Vertex } from "./model";
import { fit, type Size } from "./viewport";

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

/** The way in which the layers follow each other. */
export type Flow = "right" | "down";

export interface Layout {
  readonly flow: Flow;
  readonly vertices: ReadonlyMap<string, Box>;
  /** The points through which each edge goes, from its start to its end. */
  readonly edges: ReadonlyMap<string, readonly Point[]>;
  readonly groups: ReadonlyMap<string, Box>;
  readonly size: Size;
}

/** Returns the width of a vertex's label in pixels. */
export type Measure = (label: string, kind: Vertex["kind"]) => number;

const CARD_HEIGHT = 44;
const SERVICE_HEIGHT = 28;
/** Least width of a card: room for a state or a rate, which change while the layout stays. */
const LEAST_WIDTH = 104;
const PADDING = 12;
const GROUP_LABEL = 22;
const MARGIN = 24;
/** Length over which an edge leaves and enters straight. */
const LEAD = 16;

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
  const [vertices, edges, groups] = [new Map<string, Box>(), new Map<string, readonly Point[]>(), new Map<string, Box>()];
  parts.forEach((part, index) => {
    const { x, y } = places[index] ?? { x: 0, y: 0 };
    const moved = <Place extends Point>(place: Place): Place => ({ ...place, x: place.x + x, y: place.y + y });
    for (const [id, box] of part.vertices) vertices.set(id, moved(box));
    for (const [id, points] of part.edges) edges.set(id, points.map(moved));
    for (const [name, box] of part.groups) groups.set(name, moved(box));
  });
  return { flow, vertices, edges, groups, size };
}

export function layoutOf(model: GraphModel, measure: Measure, flow: Flow): Layout {
  const graph = new Graph({ compound: true, multigraph: true });
  const rankdir = flow === "right" ? "LR" : "TB";
  graph.setGraph({ rankdir, nodesep: 16, edgesep: 12, ranksep: 48, marginx: MARGIN, marginy: MARGIN });
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
  return read(graph, model, flow);
}

const groupId = (group: string): string => `group ${group}`;

function sizeOf({ label, kind }: Vertex, measure: Measure): Size {
  const width = Math.ceil(measure(label, kind)) + 2 * PADDING;
  if (kind === "service") return { width, height: SERVICE_HEIGHT };
  return { width: Math.max(LEAST_WIDTH, width), height: CARD_HEIGHT };
}

interface Placed {
  readonly x: number;
  readonly y: number;
  readonly width: number;
  readonly height: number;
}

function read(graph: Graph, model: GraphModel, flow: Flow): Layout {
  const boxOf = (id: string): Box => {
    const { x, y, width, height } = graph.node(id) as Placed;
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

/** Returns an edge's points with its ends at the middle of the sides that face each other. */
function attached(edge: Edge, points: readonly Point[], boxes: ReadonlyMap<string, Box>, flow: Flow): readonly Point[] {
  const [from, to] = [boxes.get(edge.from), boxes.get(edge.to)];
  if (from === undefined || to === undefined || points.length < 2) return points;
  const isRight = flow === "right";
  const start = isRight
    ? { x: from.x + from.width, y: from.y + from.height / 2 }
    : { x: from.x + from.width / 2, y: from.y + from.height };
  const end = isRight ? { x: to.x, y: to.y + to.height / 2 } : { x: to.x + to.width / 2, y: to.y };
  // An edge that goes back, against the layers, keeps the ends that the layout gave it.
  if (isRight ? end.x < start.x : end.y < start.y) return points;
  // Between neighbouring layers there is one point, which would only bend the curve.
  return points.length <= 3 ? [start, end] : [start, ...points.slice(1, -1), end];
}

/** Returns the path of an edge as SVG's `d`: an S-curve, or a smooth curve along the points on its way. */
export function pathOf(points: readonly Point[], flow: Flow): string {
  const [start, end] = [points[0], points.at(-1)];
  if (start === undefined || end === undefined) return "";
  const reach = points.length === 2 ? (flow === "right" ? end.x - start.x : end.y - start.y) / 2 : LEAD;
  const [out, into] = [ahead(start, reach, flow), ahead(end, -reach, flow)];
  if (points.length === 2) return `M${textOf(start)}C${textOf(out)} ${textOf(into)} ${textOf(end)}`;
  return `M${textOf(start)}${splineThrough([start, out, ...points.slice(1, -1), into, end])}`;
}

function ahead({ x, y }: Point, distance: number, flow: Flow): Point {
  return flow === "right" ? { x: x + distance, y } : { x, y: y + distance };
}

/** Returns a cubic B-spline that begins and ends at its first and last point, and rounds those between. */
function splineThrough(points: readonly Point[]): string {
  const [first, last] = [points[0], points.at(-1)];
  if (first === undefined || last === undefined) return "";
  const controls = [first, first, ...points.slice(1, -1), last, last];
  let path = "";
  for (let index = 1; index + 2 < controls.length; index += 1) {
    const [one, other, next] = [controls[index], controls[index + 1], controls[index + 2]];
    if (one === undefined || other === undefined || next === undefined) break;
    const third = mix(one, other, 1 / 3);
    const twoThirds = mix(one, other, 2 / 3);
    const knot = index + 3 === controls.length ? last : mix(twoThirds, mix(other, next, 1 / 3), 1 / 2);
    path += `C${textOf(third)} ${textOf(twoThirds)} ${textOf(knot)}`;
  }
  return path;
}

function mix(one: Point, other: Point, part: number): Point {
  return { x: one.x + (other.x - one.x) * part, y: one.y + (other.y - one.y) * part };
}

/** Returns the point half way along an edge's points, where its label stands. */
export function middleOf(points: readonly Point[]): Point {
  const place = (points.length - 1) / 2;
  const [one, other] = [points[Math.floor(place)], points[Math.ceil(place)]];
  if (one === undefined || other === undefined) return { x: 0, y: 0 };
  return { x: (one.x + other.x) / 2, y: (one.y + other.y) / 2 };
}

const textOf = ({ x, y }: Point): string => `${Math.round(x * 10) / 10} ${Math.round(y * 10) / 10}`;

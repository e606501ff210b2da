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

/** The way of an edge. */
export interface Route {
  /** The points along which it goes, from its start to its end. */
  readonly points: readonly Point[];
  /** Whether it goes back to a neighbour, in an arc beside the edge that came from there. */
  readonly isArc: boolean;
}

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
/** How far an arc swings out. */
const ARC = 32;
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
  return { width: Math.max(kind === "group" ? LEAST_GROUP_WIDTH : LEAST_WIDTH, width), height: CARD_HEIGHT };
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

/** Returns the box where the flow begins. */
export function beginningOf({ flow, vertices }: Layout): Box {
  const wayTo = ({ x, y }: Box): number => (flow === "right" ? x : y);
  const nearer = (one: Box, other: Box): Box => (wayTo(other) < wayTo(one) ? other : one);
  return [...vertices.values()].reduce(nearer, { x: Infinity, y: Infinity, width: 0, height: 0 });
}

/** Returns an edge's route with its ends at the middle of the sides that face each other. */
function attached(edge: Edge, points: readonly Point[], boxes: ReadonlyMap<string, Box>, flow: Flow): Route {
  const [from, to] = [boxes.get(edge.from), boxes.get(edge.to)];
  if (from === undefined || to === undefined || points.length < 2) return { points, isArc: false };
  const isRight = flow === "right";
  const isNeighbour = points.length <= 3; // between neighbouring layers there is one point
  const [start, end] = isRight ? [sideOf(from, "right"), sideOf(to, "left")] : [sideOf(from, "bottom"), sideOf(to, "top")];
  if (isRight ? end.x < start.x : end.y < start.y) {
    if (!isNeighbour) return { points, isArc: false };
    const side = isRight ? "bottom" : "right";
    return { points: [sideOf(from, side), sideOf(to, side)], isArc: true };
  }
  return { points: isNeighbour ? [start, end] : [start, ...points.slice(1, -1), end], isArc: false };
}

/** Returns the middle of a side of a box. */
function sideOf({ x, y, width, height }: Box, side: "left" | "right" | "top" | "bottom"): Point {
  switch (side) {
    case "left":
      return { x, y: y + height / 2 };
    case "right":
      return { x: x + width, y: y + height / 2 };
    case "top":
      return { x: x + width / 2, y };
    case "bottom":
      return { x: x + width / 2, y: y + height };
  }
}

/** Returns where an arc bends to: aside from the flow. */
function aside({ x, y }: Point, distance: number, flow: Flow): Point {
  return flow === "right" ? { x, y: y + distance } : { x: x + distance, y };
}

/** Returns the path of an edge as SVG's `d`: an S-curve, or a smooth curve along the points on its way. */
export function pathOf({ points, isArc }: Route, flow: Flow): string {
  const [start, end] = [points[0], points.at(-1)];
  if (start === undefined || end === undefined) return "";
  if (isArc) {
    const [out, into] = [aside(start, ARC, flow), aside(end, ARC, flow)];
    return `M${textOf(start)}C${textOf(out)} ${textOf(into)} ${textOf(end)}`;
  }
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

/** Returns the point half way along an edge, where its label stands. */
export function middleOf({ points, isArc }: Route, flow: Flow): Point {
  const place = (points.length - 1) / 2;
  const [one, other] = [points[Math.floor(place)], points[Math.ceil(place)]];
  if (one === undefined || other === undefined) return { x: 0, y: 0 };
  const middle = mix(one, other, 1 / 2);
  return isArc ? aside(middle, 0.75 * ARC, flow) : middle;
}

const textOf = ({ x, y }: Point): string => `${Math.round(x * 10) / 10} ${Math.round(y * 10) / 10}`;

/** Routes: where edges are drawn between their vertices, and the paths of SVG along them. Pure. */
import type { Box, Point } from "./geometry";
import type { Edge } from "./model";

/** The direction in which the layers follow each other. */
export type Flow = "right" | "down";

/** The course of an edge. */
export interface Route {
  /** The points along which it goes, from its start to its end. */
  readonly points: readonly Point[];
  /** Whether it goes back to a neighbour, in an arc beside the edge that came from there. */
  readonly isArc: boolean;
}

/** How far an arc swings out. */
const ARC = 32;
/** Length over which an edge leaves and enters straight. */
const LEAD = 16;

/** Returns an edge's route with its ends at the middle of the sides that face each other. */
export function attached(edge: Edge, points: readonly Point[], boxes: ReadonlyMap<string, Box>, flow: Flow): Route {
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

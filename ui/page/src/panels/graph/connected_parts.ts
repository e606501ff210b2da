/** Connected parts of a graph, and how they are packed beside and below each other. Pure. */
import type { Point, Size } from "./geometry";
import type { GraphModel } from "./model";

/** Splits a model into its connected parts, the largest first; the members of a group stay together. */
export function connectedParts(model: GraphModel): readonly GraphModel[] {
  const above = new Map(model.vertices.map(({ id }) => [id, id]));
  const root = (id: string): string => {
    let found = id;
    while ((above.get(found) ?? found) !== found) found = above.get(found) ?? found;
    above.set(id, found);
    return found;
  };
  const join = (one: string, other: string): void => {
    const [low, high] = [root(one), root(other)].sort() as [string, string];
    above.set(high, low);
  };
  for (const { from, to } of model.edges) join(from, to);
  const firsts = new Map<string, string>();
  for (const { id, group } of model.vertices) {
    if (group === null) continue;
    join(firsts.get(group) ?? id, id);
    firsts.set(group, firsts.get(group) ?? id);
  }
  const parts = new Map<string, { vertices: GraphModel["vertices"][number][]; edges: GraphModel["edges"][number][] }>();
  for (const vertex of model.vertices) {
    const part = parts.get(root(vertex.id)) ?? { vertices: [], edges: [] };
    part.vertices.push(vertex);
    parts.set(root(vertex.id), part);
  }
  for (const edge of model.edges) parts.get(root(edge.from))?.edges.push(edge);
  // The sort is stable: parts of one size keep the order of their names.
  return [...parts.values()].sort((one, other) => other.vertices.length - one.vertices.length);
}

export interface Packed {
  /** The left upper corner of each box, in the order of the boxes. */
  readonly places: readonly Point[];
  readonly size: Size;
}

/** Packs boxes into rows so that all of them are seen as large as possible on a screen. */
export function pack(boxes: readonly Size[], screen: Size): Packed {
  const widest = Math.max(...boxes.map(({ width }) => width));
  let best = inRows(boxes, widest);
  let firstRow = 0;
  // Each number of boxes in the first row gives a width to try.
  for (const { width } of boxes) {
    firstRow += width;
    const tried = inRows(boxes, Math.max(widest, firstRow));
    if (scaleOf(tried.size, screen) > scaleOf(best.size, screen)) best = tried;
  }
  return best;
}

function scaleOf(size: Size, screen: Size): number {
  return Math.min(screen.width / size.width, screen.height / size.height);
}

/** Packs boxes into rows of a width; beside a high box, low ones stand below each other. */
function inRows(boxes: readonly Size[], most: number): Packed {
  const places: Point[] = [];
  let [x, y, rowHeight, width] = [0, 0, 0, 0];
  let column: Size = { width: 0, height: 0 };
  for (const box of boxes) {
    const fitsBelow = column.height + box.height <= rowHeight && x + box.width <= most + 0.5;
    if (!fitsBelow) {
      x += column.width;
      column = { width: 0, height: 0 };
      if (x > 0 && x + box.width > most + 0.5) [x, y, rowHeight] = [0, y + rowHeight, 0];
    }
    places.push({ x, y: y + column.height });
    column = { width: Math.max(column.width, box.width), height: column.height + box.height };
    [width, rowHeight] = [Math.max(width, x + column.width), Math.max(rowHeight, column.height)];
  }
  return { places, size: { width, height: y + rowHeight } };
}

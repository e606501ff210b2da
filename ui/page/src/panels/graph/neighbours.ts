/** The way of the arrow keys through the drawing. Pure. */
import type { Box } from "./geometry";

export type Direction = "left" | "right" | "up" | "down";

/** Returns the vertex nearest in a direction, or null at the edge of the drawing. */
export function nearest(boxes: ReadonlyMap<string, Box>, from: string, direction: Direction): string | null {
  const start = boxes.get(from);
  if (start === undefined) return null;
  let best: string | null = null;
  let least = Infinity;
  for (const [id, box] of boxes) {
    if (id === from) continue;
    const [along, across] = distances(start, box, direction);
    const cost = along + 2 * Math.abs(across);
    if (along > 1 && cost < least) [best, least] = [id, cost];
  }
  return best;
}

/** Returns how far a box is ahead in a direction, and how far aside. */
function distances(from: Box, to: Box, direction: Direction): readonly [number, number] {
  const dx = to.x + to.width / 2 - from.x - from.width / 2;
  const dy = to.y + to.height / 2 - from.y - from.height / 2;
  switch (direction) {
    case "right":
      return [dx, dy];
    case "left":
      return [-dx, dy];
    case "down":
      return [dy, dx];
    case "up":
      return [-dy, dx];
  }
}

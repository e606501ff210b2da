/** The viewport: which part of the drawing is seen, and how large. Pure. */
import type { Box, Point, Size } from "./geometry";

/** Drawing coordinates become screen coordinates by `screen = drawing * scale + offset`. */
export interface Viewport extends Point {
  readonly scale: number;
}

const SMALLEST = 0.08;
const LARGEST = 3;
const FIT_LARGEST = 1.25;

/** Returns the viewport that shows the whole drawing in the middle, at most a quarter larger than drawn. */
export function fit(drawing: Size, screen: Size): Viewport {
  if (drawing.width <= 0 || drawing.height <= 0 || screen.width <= 0 || screen.height <= 0) return { x: 0, y: 0, scale: 1 };
  const scale = clamp(Math.min(screen.width / drawing.width, screen.height / drawing.height), SMALLEST, FIT_LARGEST);
  return {
    x: (screen.width - drawing.width * scale) / 2,
    y: (screen.height - drawing.height * scale) / 2,
    scale,
  };
}

/** Least scale at which names are read: they are 10 px high then. */
export const READABLE = 0.85;

/** Returns the viewport in which names can be read: the whole drawing, or where it is too large what is around a box. */
export function readable(drawing: Size, screen: Size, start: Box): Viewport {
  const whole = fit(drawing, screen);
  if (whole.scale >= READABLE) return whole;
  const place = (length: number, room: number, middle: number): number => {
    const left = room - length * READABLE;
    return left >= 0 ? left / 2 : clamp(room / 2 - middle * READABLE, left, 0);
  };
  const { x, y, width, height } = start;
  return {
    x: place(drawing.width, screen.width, x + width / 2),
    y: place(drawing.height, screen.height, y + height / 2),
    scale: READABLE,
  };
}

/** Returns the viewport larger by a factor, with a point of the screen where it is. */
export function zoom(view: Viewport, factor: number, at: Point): Viewport {
  const scale = clamp(view.scale * factor, SMALLEST, LARGEST);
  const ratio = scale / view.scale;
  return { x: at.x - (at.x - view.x) * ratio, y: at.y - (at.y - view.y) * ratio, scale };
}

export function pan(view: Viewport, dx: number, dy: number): Viewport {
  return { ...view, x: view.x + dx, y: view.y + dy };
}

/** Returns the viewport moved as little as needed for a box to be seen whole, with some room around it. */
export function reveal(view: Viewport, box: Box, screen: Size): Viewport {
  const room = 24;
  const shift = (start: number, length: number, size: number): number => {
    if (start < room) return room - start;
    return start + length > size - room ? Math.max(room - start, size - room - start - length) : 0;
  };
  const dx = shift(box.x * view.scale + view.x, box.width * view.scale, screen.width);
  const dy = shift(box.y * view.scale + view.y, box.height * view.scale, screen.height);
  return dx === 0 && dy === 0 ? view : pan(view, dx, dy);
}

function clamp(value: number, least: number, most: number): number {
  return Math.min(most, Math.max(least, value));
}

/**
 * Bitmap: lines of more points than there are columns of pixels, drawn as one upright run in each column.
 *
 * A browser strokes a path of ten thousand joints in milliseconds, and a dashed one in tens of them; twenty such lines are
 * no longer fluid. Here a line costs one pass over its points, and a frame one copy of the picture; nothing is allocated.
 */

import type { Thinned } from "../messages/thinning";

/** Where a line stands in the bitmap: `pixel = (value - from) * per`, and downwards for values. */
export interface Scaling {
  readonly fromTime: number;
  readonly perSecond: number;
  readonly greatest: number;
  readonly perUnit: number;
}

/** Colour of a line as four bytes, and of the columns in which a dashed one is faint; its dashes in pixels. */
export interface Ink {
  readonly full: number;
  readonly faint: number;
  readonly dash: readonly number[];
  /** Pixels that a line is wide. */
  readonly width: number;
}

const NOTHING = 32_767;

export class Bitmap {
  #width = 0;
  #height = 0;
  #pixels = new Uint32Array(0);
  /** Upper and lower end of the line that is being drawn, in each column. */
  #tops = new Int16Array(0);
  #bottoms = new Int16Array(0);

  /** The pixels, row by row, as bytes of red, green, blue and opacity. */
  get bytes(): Uint8ClampedArray<ArrayBuffer> {
    return new Uint8ClampedArray(this.#pixels.buffer);
  }

  /** Begins an empty picture; returns whether its size is another one than before. */
  begin(width: number, height: number): boolean {
    const isResized = width !== this.#width || height !== this.#height;
    if (isResized) {
      [this.#width, this.#height] = [width, height];
      this.#pixels = new Uint32Array(width * height);
      this.#tops = new Int16Array(width);
      this.#bottoms = new Int16Array(width);
    } else this.#pixels.fill(0);
    return isResized;
  }

  line(points: Thinned, scaling: Scaling, ink: Ink): void {
    this.#tops.fill(NOTHING);
    this.#bottoms.fill(-1);
    this.#trace(points, scaling);
    this.#fill(ink);
  }

  /** Notes the ends of the run in each column. */
  #trace({ times, values, count }: Thinned, { fromTime, perSecond, greatest, perUnit }: Scaling): void {
    let column = -1; // of the run that goes on
    let top = Infinity;
    let bottom = -Infinity;
    let beforeX = NaN;
    let beforeY = NaN;
    for (let at = 0; at < count; at += 1) {
      const x = ((times[at] ?? 0) - fromTime) * perSecond;
      const y = (greatest - (values[at] ?? NaN)) * perUnit;
      const next = Math.floor(x);
      if (next !== column || Number.isNaN(y)) {
        this.#reach(column, top, bottom);
        column = next;
        top = Infinity;
        bottom = -Infinity;
        if (beforeX < x && !Number.isNaN(y)) this.#segment(beforeX, beforeY, x, y);
      }
      if (y < top) top = y;
      if (y > bottom) bottom = y;
      beforeX = Number.isNaN(y) ? NaN : x;
      beforeY = y;
    }
    this.#reach(column, top, bottom);
  }

  /** Notes a straight line between points of different columns: in each column the part that lies in it. */
  #segment(fromX: number, fromY: number, toX: number, toY: number): void {
    const slope = (toY - fromY) / (toX - fromX);
    const last = Math.min(Math.floor(toX), this.#width - 1);
    for (let column = Math.max(0, Math.floor(fromX)); column <= last; column += 1) {
      const one = fromY + (Math.max(column, fromX) - fromX) * slope;
      const other = fromY + (Math.min(column + 1, toX) - fromX) * slope;
      this.#reach(column, one < other ? one : other, one < other ? other : one);
    }
  }

  #reach(column: number, top: number, bottom: number): void {
    if (column < 0 || column >= this.#width || top > bottom) return;
    const first = Math.max(0, Math.round(top));
    const last = Math.min(this.#height - 1, Math.round(bottom));
    if (first < (this.#tops[column] ?? 0)) this.#tops[column] = first;
    if (last > (this.#bottoms[column] ?? 0)) this.#bottoms[column] = last;
  }

  #fill({ full, faint, dash, width }: Ink): void {
    const pixels = this.#pixels;
    const rowLength = this.#width;
    const period = dash.reduce((sum, each) => sum + each, 0);
    for (let column = 0; column < rowLength; column += 1) {
      const bottom = Math.min(this.#height - 1, (this.#bottoms[column] ?? -1) + width - 1);
      const colour = period > 0 && isGap(column % period, dash) ? faint : full;
      const end = Math.min(column + width, rowLength);
      const top = (this.#tops[column] ?? NOTHING) * rowLength;
      for (let across = column; across < end; across += 1) {
        const last = bottom * rowLength + across;
        for (let place = top + across; place <= last; place += rowLength) pixels[place] = colour;
      }
    }
  }
}

/** Whether a place within a period of dashes lies between two of them. */
function isGap(place: number, dash: readonly number[]): boolean {
  let end = 0;
  for (let at = 0; at < dash.length; at += 1) {
    end += dash[at] ?? 0;
    if (place < end) return at % 2 === 1;
  }
  return false;
}

/**
 * Bitmap: lines of more points than there are columns of pixels, drawn as one upright run in each column.
 *
 * A browser strokes a path of ten thousand joints in milliseconds, and a dashed one in tens of them; twenty such lines are
 * no longer fluid. Here a line costs one pass over its columns, and a frame one copy of the picture; nothing is allocated.
 */

import type { Columns } from "./columns";

/** Where the values of a line stand in the bitmap: `pixel = (greatest - value) * perUnit`. */
export interface Scaling {
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

  line(columns: Columns, scaling: Scaling, ink: Ink): void {
    this.#tops.fill(NOTHING);
    this.#bottoms.fill(-1);
    this.#trace(columns, scaling);
    this.#fill(ink);
  }

  /** Notes the ends of the run in each column. */
  #trace(columns: Columns, { greatest, perUnit }: Scaling): void {
    const { least: leasts, greatest: greatests } = columns;
    for (let column = 0; column < leasts.length; column += 1) {
      this.#reach(column, (greatest - (greatests[column] ?? NaN)) * perUnit, (greatest - (leasts[column] ?? NaN)) * perUnit);
    }
    columns.join((fromX, from, toX, to) => this.#segment(fromX, (greatest - from) * perUnit, toX, (greatest - to) * perUnit));
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
    if (column < 0 || column >= this.#width || !(top <= bottom)) return; // NaN is a column without points
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

/**
 * Columns: what a screen can show of a line that has more points than there are columns of pixels. Each column keeps the
 * first, the least, the greatest and the last of its points: no peak is lost, however short.
 *
 * Columns are counted from time 0, wherever the picture begins. So while a plot follows what comes, a picture is the one
 * before moved by whole columns, and only the points that are new are looked at.
 */

import { firstAfter, type Points } from "../messages/ring";
import type { Stretch } from "./timeline";

/** Columns that a plot shows. */
export interface View {
  /** Number of the leftmost, counted from time 0. */
  readonly first: number;
  readonly perSecond: number;
  readonly columns: number;
}

const GAP_BEFORE = 1;
const GAP_AFTER = 2;

/** Returns the view of a stretch, moved by less than a column, so that its end lies in the last one. */
export function viewOf({ from, to }: Stretch, columns: number): View {
  const perSecond = columns / (to - from);
  return { first: Math.floor(to * perSecond) + 1 - columns, perSecond, columns };
}

export function stretchOf({ first, perSecond, columns }: View): Stretch {
  return { from: first / perSecond, to: (first + columns) / perSecond };
}

/** Returns the points within a stretch, with the neighbour on either side, to which the line leaves the picture. */
export function pointsWithin({ times, values, revision }: Points, { from, to }: Stretch): Points {
  const begin = Math.max(0, firstAfter(times, from) - 1);
  const end = Math.min(times.length, firstAfter(times, to) + 1);
  return { times: times.subarray(begin, end), values: values.subarray(begin, end), revision };
}

export class Columns {
  #view: View = { first: 0, perSecond: 0, columns: 0 };
  #revision = -1;
  /** Number of the column in which the last known point lies: others may follow there. */
  #open = 0;
  #gaps = new Uint8Array(0);
  #times: readonly [first: Float64Array, last: Float64Array] = [new Float64Array(0), new Float64Array(0)];
  #ends: readonly [first: Float64Array, last: Float64Array] = [new Float64Array(0), new Float64Array(0)];
  /** Least value of each column; NaN where it has no point. */
  least = new Float64Array(0);
  greatest = new Float64Array(0);
  /** The points beside the picture, left and right; NaN where there is none. */
  readonly #neighbours = { times: new Float64Array(2), values: new Float64Array(2) };

  /** Takes the points that a view shows, which are in the order of their times. */
  update(points: Points, view: View): void {
    const known = this.#keep(points.revision, view);
    const { first, perSecond, columns } = view;
    const { times, values } = points;
    let at = firstAfter(times, (first + known - 0.5) / perSecond);
    let column = known;
    for (; at < times.length; at += 1) {
      const time = times[at] ?? 0;
      column = Math.floor(time * perSecond) - first;
      if (column >= columns) break;
      if (column >= known) this.#add(column, time, values[at] ?? NaN);
    }
    this.#open = first + Math.min(columns, Math.max(known, column));
    this.#noteNeighbours(points, at);
  }

  /**
   * Calls `join` with each piece of the line between the points of two columns, whose places are in columns from the
   * left; a line breaks at its gaps. Those within a column are narrower than a pixel, and are left out.
   */
  join(join: (fromX: number, fromValue: number, toX: number, toValue: number) => void): void {
    const { first, perSecond, columns } = this.#view;
    const [firstTimes, lastTimes] = this.#times;
    const [firsts, lasts] = this.#ends;
    const { times, values } = this.#neighbours;
    let x = (times[0] ?? NaN) * perSecond - first;
    let value = values[0] ?? NaN;
    for (let column = 0; column < columns; column += 1) {
      const gaps = this.#gaps[column] ?? 0;
      if ((gaps & GAP_BEFORE) !== 0) x = NaN;
      const next = firsts[column] ?? NaN;
      if (Number.isNaN(next)) continue;
      const nextX = (firstTimes[column] ?? NaN) * perSecond - first;
      if (x < nextX) join(x, value, nextX, next);
      x = (gaps & GAP_AFTER) === 0 ? (lastTimes[column] ?? NaN) * perSecond - first : NaN;
      value = lasts[column] ?? NaN;
    }
    const endX = (times[1] ?? NaN) * perSecond - first;
    if (x < endX) join(x, value, endX, values[1] ?? NaN);
  }

  /** Moves what is known to where the view has it; returns how many columns need not be looked at again. */
  #keep(revision: number, view: View): number {
    const { first, perSecond, columns } = this.#view;
    const moved = view.first - first;
    const isSame = revision === this.#revision && view.perSecond === perSecond && view.columns === columns;
    const known = isSame && moved >= 0 ? Math.max(0, this.#open - view.first) : 0;
    if (columns !== view.columns) this.#makeRoom(view.columns);
    [this.#view, this.#revision] = [view, revision];
    if (known > 0 && moved > 0) for (const each of [this.#gaps, ...this.#values]) each.copyWithin(0, moved);
    this.#gaps.fill(0, known);
    for (const each of this.#values) each.fill(NaN, known);
    return known;
  }

  get #values(): readonly Float64Array[] {
    return [this.least, this.greatest, ...this.#ends, ...this.#times];
  }

  #makeRoom(columns: number): void {
    const room = (): Float64Array<ArrayBuffer> => new Float64Array(columns);
    this.#gaps = new Uint8Array(columns);
    [this.least, this.greatest] = [room(), room()];
    [this.#ends, this.#times] = [[room(), room()], [room(), room()]];
  }

  #add(column: number, time: number, value: number): void {
    const isEmpty = Number.isNaN(this.least[column]);
    if (Number.isNaN(value)) {
      this.#gaps[column] = (this.#gaps[column] ?? 0) | (isEmpty ? GAP_BEFORE : GAP_AFTER);
      return;
    }
    if (isEmpty) {
      this.least[column] = this.greatest[column] = this.#ends[0][column] = value;
      this.#times[0][column] = time;
    } else if (value < (this.least[column] ?? NaN)) this.least[column] = value;
    else if (value > (this.greatest[column] ?? NaN)) this.greatest[column] = value;
    this.#gaps[column] = (this.#gaps[column] ?? 0) & ~GAP_AFTER;
    this.#ends[1][column] = value;
    this.#times[1][column] = time;
  }

  /** Notes the points beside the picture, to which the line leaves it; `end` is the place of the one on the right. */
  #noteNeighbours({ times, values }: Points, end: number): void {
    const { first, perSecond } = this.#view;
    let before = firstAfter(times, (first + 0.5) / perSecond) - 1;
    while (before >= 0 && Math.floor((times[before] ?? 0) * perSecond) >= first) before -= 1;
    for (const [side, at] of [before, end].entries()) {
      const value = values[at] ?? NaN;
      this.#neighbours.times[side] = Number.isNaN(value) ? NaN : (times[at] ?? NaN);
      this.#neighbours.values[side] = value;
    }
  }
}

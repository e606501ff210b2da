/**
 * Thinning: the points of a line that a screen can show. In each column of pixels it keeps the first, the least, the
 * greatest and the last point, so the drawn line is the same as that of all points: no peak is lost, however short.
 */

import { firstAfter, type Points } from "./ring";

/** Points that are drawn; a value that is NaN is a gap. Reused from frame to frame. */
export interface Thinned {
  times: Float64Array;
  values: Float64Array;
  count: number;
}

/** Stretch of time that a plot shows, in seconds, and how many columns of pixels it has for it. */
export interface View {
  readonly from: number;
  readonly to: number;
  readonly columns: number;
}

// First, least, greatest, last, and a gap on either side.
const MOST_PER_COLUMN = 6;

/** Returns room for the points of so many columns. */
export function thinnedOf(columns: number): Thinned {
  const size = columns * MOST_PER_COLUMN + 2;
  return { times: new Float64Array(size), values: new Float64Array(size), count: 0 };
}

/** Puts the points that `view` shows into `into`, with the neighbour on either side, to which the line leaves the picture. */
export function thin(points: Points, view: View, into: Thinned): void {
  const { times, values } = points;
  const begin = Math.max(0, firstAfter(times, view.from) - 1);
  const end = Math.min(times.length, firstAfter(times, view.to) + 1);
  if (into.times.length < view.columns * MOST_PER_COLUMN + 2) Object.assign(into, thinnedOf(view.columns));
  into.count = 0;
  if (end - begin <= view.columns * 2) {
    into.times.set(times.subarray(begin, end));
    into.values.set(values.subarray(begin, end));
    into.count = end - begin;
    return;
  }
  const perSecond = view.columns / (view.to - view.from);
  let column = NaN;
  let start = begin;
  let first = -1;
  let least = -1;
  let greatest = -1;
  let last = -1;
  for (let at = begin; at < end; at += 1) {
    const next = Math.floor(((times[at] ?? 0) - view.from) * perSecond);
    if (next !== column) {
      if (at > begin) putColumn(points, { start, first, least, greatest, last, end: at }, into);
      column = next;
      start = at;
      first = least = greatest = last = -1;
    }
    const value = values[at] ?? NaN;
    if (Number.isNaN(value)) continue;
    last = at;
    if (first === -1) first = least = greatest = at;
    else if (value < (values[least] ?? NaN)) least = at;
    else if (value > (values[greatest] ?? NaN)) greatest = at;
  }
  putColumn(points, { start, first, least, greatest, last, end }, into);
}

/** Places of a column's points; -1 where it has nothing but gaps. */
interface Column {
  readonly start: number;
  readonly first: number;
  readonly least: number;
  readonly greatest: number;
  readonly last: number;
  readonly end: number;
}

/** Puts the points of one column into `into`. Gaps between its points are narrower than a pixel, and are left out. */
function putColumn(points: Points, { start, first, least, greatest, last, end }: Column, into: Thinned): void {
  if (first !== start) put(points, start, into); // a gap comes before the first point
  if (first === -1) return;
  const second = Math.min(least, greatest);
  const third = Math.max(least, greatest);
  put(points, first, into);
  if (second !== first) put(points, second, into);
  if (third !== second) put(points, third, into);
  if (last !== third) put(points, last, into);
  if (last !== end - 1) put(points, end - 1, into); // a gap follows the last point
}

function put({ times, values }: Points, at: number, into: Thinned): void {
  into.times[into.count] = times[at] ?? 0;
  into.values[into.count] = values[at] ?? NaN;
  into.count += 1;
}

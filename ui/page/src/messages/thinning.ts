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
  let at = begin;
  while (at < end) {
    const column = Math.floor(((times[at] ?? 0) - view.from) * perSecond);
    let next = at + 1;
    while (next < end && Math.floor(((times[next] ?? 0) - view.from) * perSecond) === column) next += 1;
    thinColumn(points, at, next, into);
    at = next;
  }
}

/** Puts the points of one column into `into`. Gaps between its points are narrower than a pixel, and are left out. */
function thinColumn(points: Points, begin: number, end: number, into: Thinned): void {
  const { values } = points;
  let [first, least, greatest, last] = [-1, -1, -1, -1];
  for (let at = begin; at < end; at += 1) {
    const value = values[at] ?? NaN;
    if (Number.isNaN(value)) continue;
    if (first === -1) first = least = greatest = at;
    if (value < (values[least] ?? NaN)) least = at;
    if (value > (values[greatest] ?? NaN)) greatest = at;
    last = at;
  }
  if (first !== begin) put(points, begin, into); // a gap comes before the first point
  if (first === -1) return;
  const [second, third] = least < greatest ? [least, greatest] : [greatest, least];
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

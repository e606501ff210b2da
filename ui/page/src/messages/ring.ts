/**
 * Ring: the latest points of one line, as typed arrays, in the order of their stamps.
 *
 * A point that comes a little late is put in its place. A point that lies further back means that time has jumped, as when
 * a simulation begins again: the points after it are of a time that has not come yet, so they are dropped, and a gap
 * (a point whose value is NaN) keeps the line from being drawn across the jump.
 */

/** Points of a line, in the order of their times, which are in seconds. A value that is NaN is a gap. */
export interface Points {
  readonly times: Float64Array;
  readonly values: Float64Array;
  /** Points of one revision differ only by those that were added after all others, and by the oldest, which are gone. */
  readonly revision: number;
}

let revisions = 0;

/** Returns a revision that no other points have. */
export function newRevision(): number {
  return (revisions += 1);
}

const FIRST_SIZE = 1024;
const LATE_S = 1;
const MOST_LATE_POINTS = 256;

export class Ring {
  #times = new Float64Array(FIRST_SIZE);
  #values = new Float64Array(FIRST_SIZE);
  #start = 0;
  #end = 0;
  #changes = 0;
  #revision = newRevision();

  /** Keeps the points of the last `spanS` seconds, and at most `most` of them, which is more than may come late. */
  constructor(
    readonly most: number,
    readonly spanS: number,
  ) {
    if (most <= MOST_LATE_POINTS) throw new RangeError(`a ring keeps more than ${MOST_LATE_POINTS} points, got ${most}`);
  }

  get length(): number {
    return this.#end - this.#start;
  }

  /** Number that grows with each change. */
  get changes(): number {
    return this.#changes;
  }

  /** The points; valid until the next change. */
  get points(): Points {
    return {
      times: this.#times.subarray(this.#start, this.#end),
      values: this.#values.subarray(this.#start, this.#end),
      revision: this.#revision,
    };
  }

  /** Stamp of the newest point; undefined if there is none. */
  get newest(): number | undefined {
    return this.length === 0 ? undefined : this.#times[this.#end - 1];
  }

  /** Adds a point; a value that is not finite is a gap. Returns whether time has jumped back. */
  append(time: number, value: number): boolean {
    const shown = Number.isFinite(value) ? value : NaN;
    const newest = this.newest;
    this.#changes += 1;
    if (newest === undefined || time >= newest) {
      this.#push(time, shown);
      this.#trim(time - this.spanS);
      return false;
    }
    const pointsAfter = this.length - firstAfter(this.points.times, time);
    if (newest - time <= LATE_S && pointsAfter <= MOST_LATE_POINTS) {
      this.#insert(pointsAfter, time, shown);
      return false;
    }
    this.#end -= pointsAfter;
    this.#revision = newRevision();
    if (this.length > 0) this.#push(time, NaN);
    this.#push(time, shown);
    return true;
  }

  /** Breaks the line after its newest point: what comes between is not known. */
  gap(): void {
    const newest = this.newest;
    if (newest === undefined || Number.isNaN(this.#values[this.#end - 1])) return;
    this.#changes += 1;
    this.#push(newest, NaN);
  }

  /** Drops the points after a moment. */
  cut(time: number): void {
    this.#changes += 1;
    this.#revision = newRevision();
    this.#end = this.#start + firstAfter(this.points.times, time);
  }

  #push(time: number, value: number): void {
    if (this.#end === this.#times.length) this.#makeRoom();
    this.#times[this.#end] = time;
    this.#values[this.#end] = value;
    this.#end += 1;
    if (this.length > this.most) this.#start += 1;
  }

  #insert(pointsAfter: number, time: number, value: number): void {
    this.#revision = newRevision();
    this.#push(time, value);
    const last = this.#end - 1;
    const place = last - pointsAfter;
    this.#times.copyWithin(place + 1, place, last);
    this.#values.copyWithin(place + 1, place, last);
    this.#times[place] = time;
    this.#values[place] = value;
  }

  #trim(oldest: number): void {
    while (this.#start < this.#end && (this.#times[this.#start] ?? oldest) < oldest) this.#start += 1;
  }

  /** Doubles the arrays, or where they are twice as long as what is kept, moves the points to their beginning. */
  #makeRoom(): void {
    const { length } = this;
    const { times, values } = this.points;
    if (length * 2 > this.#times.length && this.#times.length < this.most * 2) {
      const size = Math.min(this.#times.length * 2, this.most * 2);
      this.#times = new Float64Array(size);
      this.#values = new Float64Array(size);
    }
    this.#times.set(times);
    this.#values.set(values);
    this.#start = 0;
    this.#end = length;
  }
}

/** Returns the place of the first of sorted times that is after `time`; their number if there is none. */
export function firstAfter(times: Float64Array, time: number): number {
  let [low, high] = [0, times.length];
  while (low < high) {
    const middle = (low + high) >>> 1;
    if ((times[middle] ?? 0) <= time) low = middle + 1;
    else high = middle;
  }
  return low;
}

/** Returns the value of the last point at or before `time`; undefined before the first point, and within a gap. */
export function valueBefore({ times, values }: Points, time: number): number | undefined {
  const value = values[firstAfter(times, time) - 1];
  return value === undefined || Number.isNaN(value) ? undefined : value;
}

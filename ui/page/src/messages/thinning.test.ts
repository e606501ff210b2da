import assert from "node:assert/strict";
import test from "node:test";
import { randomOf } from "../testing/random";
import type { Points } from "./ring";
import { thin, thinnedOf, type View } from "./thinning";

/** Points with bursts, gaps and equal stamps. */
function someLine(random: () => number, most: number): Points {
  const count = Math.floor(random() * most);
  const gaps = random() < 0.5 ? 0 : random() * 0.3;
  let time = random() * 10 - 5;
  const times = Float64Array.from({ length: count }, () => (time += random() < 0.1 ? 0 : random() * random() * 0.1));
  const values = Float64Array.from(times, () => (random() < gaps ? NaN : (random() - 0.5) / (random() + 0.001)));
  return { times, values };
}

function thinned(points: Points, view: View): { times: number[]; values: number[] } {
  const into = thinnedOf(view.columns);
  thin(points, view, into);
  return { times: [...into.times.slice(0, into.count)], values: [...into.values.slice(0, into.count)] };
}

function columnOf(time: number, view: View): number {
  return Math.floor((time - view.from) * (view.columns / (view.to - view.from)));
}

function someCases(check: (points: Points, view: View, seed: number) => void): void {
  for (let seed = 0; seed < 500; seed += 1) {
    const random = randomOf(seed);
    const from = random() * 20 - 10;
    check(someLine(random, 3000), { from, to: from + 0.1 + random() * 30, columns: 1 + Math.floor(random() * 200) }, seed);
  }
}

test("each column keeps its least and greatest value", () => {
  someCases((points, view, seed) => {
    const extremes = (times: ArrayLike<number>, values: ArrayLike<number>): Map<number, [number, number]> => {
      const found = new Map<number, [number, number]>();
      for (let at = 0; at < times.length; at += 1) {
        const [time, value] = [times[at]!, values[at]!];
        if (Number.isNaN(value) || time < view.from || time > view.to) continue;
        const [least, greatest] = found.get(columnOf(time, view)) ?? [value, value];
        found.set(columnOf(time, view), [Math.min(least, value), Math.max(greatest, value)]);
      }
      return found;
    };
    const { times, values } = thinned(points, view);
    assert.deepEqual(extremes(times, values), extremes(points.times, points.values), `seed ${seed}`);
  });
});

test("what is drawn are points of the line in order", () => {
  someCases((points, view, seed) => {
    const { times, values } = thinned(points, view);
    let at = 0;
    times.forEach((time, index) => {
      while (at < points.times.length && !(points.times[at] === time && Object.is(points.values[at], values[index]))) at += 1;
      assert.ok(at < points.times.length, `seed ${seed}: no point ${time}, ${values[index]} follows`);
      at += 1;
    });
  });
});

test("no line is drawn across a gap between columns", () => {
  someCases((points, view, seed) => {
    const { times, values } = thinned(points, view);
    for (let at = 1; at < times.length; at += 1) {
      const [before, after] = [times[at - 1]!, times[at]!];
      if (Number.isNaN(values[at - 1]) || Number.isNaN(values[at]) || columnOf(before, view) === columnOf(after, view)) continue;
      const hasGap = points.values.some((value, index) => Number.isNaN(value) && points.times[index]! > before && points.times[index]! < after);
      assert.ok(!hasGap, `seed ${seed}: a line from ${before} to ${after}`);
    }
  });
});

test("the number drawn depends on columns alone", () => {
  someCases((points, view, seed) => {
    assert.ok(thinned(points, view).times.length <= view.columns * 6 + 2, `seed ${seed}`);
  });
  const times = Float64Array.from({ length: 100_000 }, (_, at) => at / 1000);
  const drawn = thinned({ times, values: times.map((time) => Math.sin(time * 100)) }, { from: 0, to: 100, columns: 500 });
  assert.ok(drawn.times.length <= 500 * 4 + 2, String(drawn.times.length));
});

test("a peak of one point in 100000 is drawn", () => {
  const times = Float64Array.from({ length: 100_000 }, (_, at) => at / 1000);
  const values = new Float64Array(100_000);
  values[54_321] = 1;
  values[12_345] = -1;
  const drawn = thinned({ times, values }, { from: 0, to: 100, columns: 500 });
  assert.equal(Math.max(...drawn.values), 1);
  assert.equal(Math.min(...drawn.values), -1);
});

test("a line leaves the picture on both sides", () => {
  const times = Float64Array.from({ length: 11 }, (_, at) => at);
  assert.deepEqual(thinned({ times, values: times }, { from: 3.5, to: 6.5, columns: 100 }).times, [3, 4, 5, 6, 7]);
  assert.deepEqual(thinned({ times, values: times }, { from: 3.4, to: 3.5, columns: 100 }).times, [3, 4]);
  assert.deepEqual(thinned({ times, values: times }, { from: 20, to: 30, columns: 100 }).times, [10]);
});

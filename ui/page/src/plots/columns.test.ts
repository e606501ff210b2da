import assert from "node:assert/strict";
import { test } from "node:test";
import { Ring, type Points } from "../messages/ring";
import { randomOf } from "../testing/random";
import { Columns, pointsWithin, stretchOf, viewOf, type View } from "./columns";

/** Points with bursts, gaps and equal stamps. */
function someLine(random: () => number, most: number): Points {
  const count = Math.floor(random() * most);
  const gaps = random() < 0.5 ? 0 : random() * 0.3;
  let time = random() * 10 - 5;
  const times = Float64Array.from({ length: count }, () => (time += random() < 0.1 ? 0 : random() * random() * 0.1));
  const values = Float64Array.from(times, () => (random() < gaps ? NaN : (random() - 0.5) / (random() + 0.001)));
  return { times, values, revision: 0 };
}

function someView(random: () => number): View {
  const from = random() * 20 - 10;
  return viewOf({ from, to: from + 0.1 + random() * 30 }, 1 + Math.floor(random() * 200));
}

function columnsOf(points: Points, view: View): Columns {
  const columns = new Columns();
  columns.update(points, view);
  return columns;
}

/** The pieces of the line between columns, with their times. */
function piecesOf(columns: Columns, view: View): [number, number, number, number][] {
  const pieces: [number, number, number, number][] = [];
  const timeAt = (x: number): number => (view.first + x) / view.perSecond;
  columns.join((fromX, from, toX, to) => pieces.push([timeAt(fromX), from, timeAt(toX), to]));
  return pieces;
}

function someCases(check: (points: Points, view: View, seed: number) => void): void {
  for (let seed = 0; seed < 500; seed += 1) {
    const random = randomOf(seed);
    check(someLine(random, 3000), someView(random), seed);
  }
}

test("each column keeps its least and greatest value", () => {
  someCases((points, view, seed) => {
    const expected = Array.from({ length: view.columns }, () => [NaN, NaN]);
    points.times.forEach((time, at) => {
      const [value, known] = [points.values[at]!, expected[Math.floor(time * view.perSecond) - view.first]];
      if (known === undefined || Number.isNaN(value)) return;
      known[0] = Number.isNaN(known[0]) ? value : Math.min(known[0]!, value);
      known[1] = Number.isNaN(known[1]) ? value : Math.max(known[1]!, value);
    });
    const { least, greatest } = columnsOf(points, view);
    assert.deepEqual([...least].map((each, at) => [each, greatest[at]]), expected, `seed ${seed}`);
  });
});

test("neighbouring points of different columns are joined", () => {
  someCases((points, view, seed) => {
    const columnAt = (at: number): number => Math.max(-1, Math.min(view.columns, Math.floor(points.times[at]! * view.perSecond) - view.first));
    const expected: number[][] = [];
    for (let at = 1; at < points.times.length; at += 1) {
      const [before, after] = [points.values[at - 1]!, points.values[at]!];
      if (columnAt(at - 1) !== columnAt(at) && !Number.isNaN(before) && !Number.isNaN(after)) expected.push([before, after]);
    }
    const found = piecesOf(columnsOf(points, view), view).map(([, from, , to]) => [from, to]);
    assert.deepEqual(found, expected, `seed ${seed}`);
  });
});

test("a picture that moves on equals a new one", () => {
  for (let seed = 0; seed < 200; seed += 1) {
    const random = randomOf(seed);
    const { times, values } = someLine(random, 2000);
    const ring = new Ring(100_000, 1000);
    const columns = new Columns();
    let view = someView(random);
    for (let at = 0; at < times.length; at += 1) {
      const isLate = random() < 0.01;
      ring.append(times[at]! - (isLate ? 0.2 : 0), values[at]!);
      if (random() < 0.01) ring.gap();
      if (random() < 0.9 && at + 1 < times.length) continue;
      if (random() < 0.05) view = someView(random);
      else if (random() < 0.8) view = { ...view, first: view.first + Math.floor(random() * 4) };
      columns.update(ring.points, view);
      const fresh = columnsOf(ring.points, view);
      assert.deepEqual([columns.least, columns.greatest], [fresh.least, fresh.greatest], `seed ${seed}`);
      assert.deepEqual(piecesOf(columns, view), piecesOf(fresh, view), `seed ${seed}`);
    }
  }
});

test("a peak of one point in 100000 is kept", () => {
  const times = Float64Array.from({ length: 100_000 }, (_, at) => at / 1000);
  const values = new Float64Array(100_000);
  values[54_321] = 1;
  values[12_345] = -1;
  const { least, greatest } = columnsOf({ times, values, revision: 0 }, viewOf({ from: 0, to: 99 }, 500));
  assert.deepEqual([Math.min(...least), Math.max(...greatest)], [-1, 1]);
});

test("a view has the end of its stretch in its last column", () => {
  for (let seed = 0; seed < 500; seed += 1) {
    const random = randomOf(seed);
    const to = random() * random() * 3600;
    const view = viewOf({ from: to - 30, to }, 1200);
    assert.equal(view.perSecond, viewOf({ from: 0, to: 30 }, 1200).perSecond, "a picture that moves has columns of one length");
    assert.equal(Math.floor(to * view.perSecond), view.first + 1199);
    const { from, to: end } = stretchOf(view);
    assert.ok(from <= to - 30 + 0.03 && end > to && end - from < 30.001, `seed ${seed}`);
  }
});

test("a line leaves the picture on both sides", () => {
  const times = Float64Array.from({ length: 11 }, (_, at) => at);
  const points = { times, values: times, revision: 0 };
  assert.deepEqual([...pointsWithin(points, { from: 3.5, to: 6.5 }).times], [3, 4, 5, 6, 7]);
  assert.deepEqual([...pointsWithin(points, { from: 3.4, to: 3.5 }).times], [3, 4]);
  assert.deepEqual([...pointsWithin(points, { from: 20, to: 30 }).times], [10]);
  const view = viewOf({ from: 3.4, to: 3.5 }, 10);
  const round = (each: number): number => Number(each.toFixed(3));
  assert.deepEqual(piecesOf(columnsOf(points, view), view).map((each) => each.map(round)), [[3, 3, 4, 4]]);
});

import assert from "node:assert/strict";
import test from "node:test";
import { randomOf } from "../testing/random";
import { firstAfter, Ring, valueBefore } from "./ring";

function pointsOf(ring: Ring): (readonly [number, number])[] {
  const { times, values } = ring.points;
  return [...times].map((time, at) => [time, values[at]!] as const);
}

test("points stand in the order of their stamps", () => {
  const ring = new Ring(1000, 60);
  for (const time of [1, 2, 3.4, 3, 2.5, 3.2]) assert.equal(ring.append(time, time * 10), false);
  assert.deepEqual(pointsOf(ring), [[1, 10], [2, 20], [2.5, 25], [3, 30], [3.2, 32], [3.4, 34]]);
});

test("a jump back drops what has not come yet", () => {
  const ring = new Ring(1000, 60);
  for (const time of [1, 2, 10, 11]) ring.append(time, time);
  assert.equal(ring.append(5, 50), true);
  assert.deepEqual(pointsOf(ring), [[1, 1], [2, 2], [5, NaN], [5, 50]]);
  assert.equal(ring.append(0.5, 9), true);
  assert.deepEqual(pointsOf(ring), [[0.5, 9]]);
});

test("many late points are a jump", () => {
  const ring = new Ring(1000, 60);
  for (let at = 0; at <= 300; at += 1) ring.append(1 + at / 1000, at);
  assert.equal(ring.append(1.0005, -1), true);
  assert.deepEqual(pointsOf(ring), [[1, 0], [1.0005, NaN], [1.0005, -1]]);
});

test("points older than the span are dropped", () => {
  const ring = new Ring(1000, 60);
  for (let time = 0; time <= 100; time += 1) ring.append(time, time);
  assert.equal(ring.length, 61);
  assert.equal(ring.points.times[0], 40);
});

test("a ring keeps no more than its most points", () => {
  const ring = new Ring(5000, 1e9);
  for (let time = 0; time < 100_000; time += 1) ring.append(time, -time);
  assert.equal(ring.length, 5000);
  assert.deepEqual([...ring.points.times.slice(0, 2)], [95_000, 95_001]);
  assert.equal(ring.points.values[4999], -99_999);
  assert.throws(() => new Ring(256, 60), RangeError);
});

test("values that are not finite are gaps", () => {
  const ring = new Ring(1000, 60);
  for (const value of [1, Infinity, -Infinity, NaN]) ring.append(1, value);
  assert.deepEqual(pointsOf(ring), [[1, 1], [1, NaN], [1, NaN], [1, NaN]]);
});

test("a break leaves one gap", () => {
  const ring = new Ring(1000, 60);
  ring.gap();
  ring.append(1, 1);
  const before = ring.changes;
  ring.gap();
  ring.gap();
  assert.deepEqual(pointsOf(ring), [[1, 1], [1, NaN]]);
  assert.equal(ring.changes, before + 1);
});

test("a ring is a sorted list under any order", () => {
  for (let seed = 0; seed < 200; seed += 1) {
    const random = randomOf(seed);
    const ring = new Ring(300, 20);
    let model: (readonly [number, number])[] = [];
    let now = 0;
    for (let step = 0; step < 2000; step += 1) {
      now += random() * 0.02;
      const time = random() < 0.2 ? now - random() * 0.9 : now;
      const newest = model.at(-1)?.[0] ?? time;
      const after = model.filter(([each]) => each > time).length;
      const jumped = time < newest && (newest - time > 1 || after > 256);
      assert.equal(ring.append(time, step), jumped);
      if (jumped) {
        model = model.slice(0, model.length - after);
        if (model.length > 0) model.push([time, NaN]);
        model.push([time, step]);
      } else {
        model.splice(model.length - after, 0, [time, step]);
        if (time >= newest) model = model.filter(([each]) => each >= time - 20);
      }
      model = model.slice(-300);
    }
    assert.deepEqual(pointsOf(ring), model, `seed ${seed}`);
  }
});

test("a moment is found between points", () => {
  const points = { times: new Float64Array([1, 2, 2, 3]), values: new Float64Array([10, 20, NaN, 30]), revision: 0 };
  assert.deepEqual([0, 1, 1.5, 2, 3, 4].map((time) => firstAfter(points.times, time)), [0, 1, 1, 3, 4, 4]);
  assert.deepEqual([0, 1, 1.9, 2.5, 9].map((time) => valueBefore(points, time)), [undefined, 10, 10, undefined, 30]);
});

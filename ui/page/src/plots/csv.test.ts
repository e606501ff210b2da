import assert from "node:assert/strict";
import test from "node:test";
import { csvOf, type Column } from "./csv";

const column = (name: string, points: readonly (readonly [number, number])[], unit?: string): Column => ({
  name,
  unit,
  points: { times: Float64Array.from(points, ([time]) => time), values: Float64Array.from(points, ([, value]) => value), revision: 0 },
});
const stampOf = (timeS: number): bigint => 1_000_000_000_000n + BigInt(Math.round(timeS * 1e9));

test("lines of different stamps share a table", () => {
  const table = csvOf([column("a.x", [[1, 0.5], [2, -1]], "m/s²"), column("b.y", [[1, 7], [1.5, 8], [3, 9]])], { from: 0, to: 10 }, stampOf);
  assert.equal(table, "stamp_ns,a.x [m/s²],b.y\n1001000000000,0.5,7\n1001500000000,,8\n1002000000000,-1,\n1003000000000,,9\n");
});

test("a table holds the shown stretch alone", () => {
  const table = csvOf([column("a", [[1, 1], [2, 2], [3, 3], [4, 4]])], { from: 2, to: 3 }, stampOf);
  assert.equal(table, "stamp_ns,a\n1002000000000,2\n1003000000000,3\n");
});

test("gaps leave no row, equal stamps each one", () => {
  const table = csvOf([column("a", [[1, 1], [1, 2], [2, NaN], [3, 1e-7]])], { from: 0, to: 9 }, stampOf);
  assert.equal(table, "stamp_ns,a\n1001000000000,1\n1001000000000,2\n1003000000000,1e-7\n");
});

test("a name is no formula and no second cell", () => {
  const [head] = csvOf([column('=1+"1",2', [])], { from: 0, to: 1 }, stampOf).split("\n");
  assert.equal(head, `stamp_ns,"'=1+""1"",2"`);
});

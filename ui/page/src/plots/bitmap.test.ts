import assert from "node:assert/strict";
import { test } from "node:test";
import { Bitmap, type Ink } from "./bitmap";
import { Columns } from "./columns";

const FULL = 0xff0000ff;
const INK: Ink = { full: FULL, faint: 0x400000ff, dash: [], width: 1 };
const UNIT = { greatest: 9, perUnit: 1 };

function points(...all: readonly (readonly [number, number])[]): Columns {
  const columns = new Columns();
  const [times, values] = [Float64Array.from(all, ([time]) => time), Float64Array.from(all, ([, value]) => value)];
  columns.update({ times, values, revision: 0 }, { first: 0, perSecond: 1, columns: 6 });
  return columns;
}

/** The rows of the picture: `#` full, `+` faint, `.` empty. */
function rows(bitmap: Bitmap, width: number): string[] {
  const pixels = new Uint32Array(bitmap.bytes.buffer);
  const signs = [...pixels].map((each) => (each === 0 ? "." : each === FULL ? "#" : "+")).join("");
  return signs.match(new RegExp(`.{${width}}`, "g")) ?? [];
}

function drawn(columns: Columns, ink: Ink = INK): string[] {
  const bitmap = new Bitmap();
  bitmap.begin(6, 10);
  bitmap.line(columns, UNIT, ink);
  return rows(bitmap, 6);
}

test("a column reaches from its least to its greatest", () => {
  const found = drawn(points([2.1, 3], [2.2, 8], [2.3, 5]));
  assert.deepEqual(found.map((row) => row[2]).join(""), ".######...");
  assert.equal(found.join("").replaceAll(".", "").length, 6);
});

test("neighbouring columns are joined", () => {
  const found = drawn(points([0.5, 9], [5.5, 0]));
  for (let column = 0; column < 6; column += 1) assert.ok(found.some((row) => row[column] === "#"), `column ${column}`);
  for (const row of found) assert.ok(row.includes("#"), "no row is left out");
});

test("a gap is left open", () => {
  const found = drawn(points([0.5, 5], [1.5, NaN], [4.5, 5]));
  assert.equal(found[4], "#...#.");
});

test("what lies outside the picture is cut off", () => {
  const found = drawn(points([-5, 5], [50, 5]));
  assert.equal(found[4], "######");
  assert.equal(found.join("").replaceAll(".", "").length, 6);
  assert.deepEqual(drawn(points([1.5, 1e9], [1.6, -1e9])).map((row) => row[1]).join(""), "##########");
});

test("a dashed line is faint between its dashes", () => {
  const found = drawn(points([0, 5], [6, 5]), { ...INK, dash: [2, 1] });
  assert.equal(found[4], "##+##+");
});

test("a new picture is empty and reuses its room", () => {
  const bitmap = new Bitmap();
  assert.equal(bitmap.begin(6, 10), true);
  const { buffer } = bitmap.bytes;
  bitmap.line(points([0, 5], [6, 5]), UNIT, INK);
  assert.equal(bitmap.begin(6, 10), false);
  assert.equal(bitmap.bytes.buffer, buffer);
  assert.equal(rows(bitmap, 6).join("").replaceAll(".", ""), "");
});

import assert from "node:assert/strict";
import test from "node:test";
import { History, type Kept } from "./history";

const SECOND = 1_000_000_000n;
const kept = (seconds: number, byteLength = 100): Kept => ({ stampNs: BigInt(Math.round(seconds * 1e9)), data: { byteLength } });
const secondsOf = (history: History<Kept>, topic: string): number[] => history.messages(topic).map((each) => Number(each.stampNs) / 1e9);

function filled(seconds: readonly number[]): History<Kept> {
  const history = new History<Kept>(60n * SECOND, 1_000_000);
  for (const each of seconds) history.add("/a", kept(each));
  return history;
}

test("the last 60 s are kept", () => {
  const history = filled(Array.from({ length: 200 }, (_, at) => at));
  assert.deepEqual([secondsOf(history, "/a")[0], secondsOf(history, "/a").length], [139, 61]);
  assert.equal(history.bytes, 61 * 300);
});

test("a message is found by its moment", () => {
  const history = filled([1, 2, 3]);
  assert.equal(history.at("/a", 2n * SECOND + 1n)?.stampNs, 2n * SECOND);
  assert.equal(history.at("/a", SECOND - 1n), undefined);
  assert.equal(history.at("/a")?.stampNs, 3n * SECOND);
  assert.equal(history.at("/b"), undefined);
});

test("a jump back drops what has not come yet", () => {
  assert.deepEqual(secondsOf(filled([1, 5, 9, 3]), "/a"), [1, 3]);
  assert.deepEqual(secondsOf(filled([1, 5, 4.5]), "/a"), [1, 5, 4.5]);
});

test("the topic with most bytes gives way", () => {
  const history = new History<Kept>(60n * SECOND, 10_000);
  for (let at = 0; at < 20; at += 1) {
    history.add("/number", kept(at, 8));
    history.add("/picture", kept(at, 2000));
    assert.ok(history.bytes <= 10_000);
  }
  assert.equal(history.messages("/number").length, 20);
  assert.deepEqual(secondsOf(history, "/picture"), [18, 19]);
});

test("a message larger than everything is not kept", () => {
  const history = filled([1]);
  history.add("/picture", kept(1, 2_000_000));
  assert.deepEqual([history.messages("/picture").length, history.bytes], [0, 300]);
});

test("a held history stays as it was", () => {
  const history = filled([1, 2]);
  history.hold();
  for (let at = 3; at < 200; at += 1) history.add("/a", kept(at));
  assert.deepEqual(secondsOf(history, "/a"), [1, 2]);
  history.release();
  assert.equal(secondsOf(history, "/a").at(-1), 199);
});

test("a forgotten topic costs nothing", () => {
  const history = filled([1, 2]);
  history.forget("/a");
  history.forget("/b");
  assert.deepEqual([history.bytes, history.messages("/a").length], [0, 0]);
});

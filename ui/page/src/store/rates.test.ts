import assert from "node:assert/strict";
import { test } from "node:test";
import type { Graph } from "../connection/answers";
import { graph, publisher, subscription, topic } from "../testing/graphs";
import { deliverKey, dropKey, publishKey, Rates } from "./rates";

function at(elapsed: number | null, published: number | null, delivered = 0, dropped = 0): Graph {
  const ends = { publishers: [publisher("/a", { published })], subscriptions: [subscription("/b", { delivered, dropped })] };
  return graph({ elapsed_s: elapsed, topics: [topic("/t", ends)] });
}

const PUBLISHED = publishKey("/t", "/a");

test("a rate needs two looks", () => {
  const rates = new Rates();
  assert.equal(rates.update(at(1, 100)).get(PUBLISHED), undefined);
  assert.equal(rates.update(at(2, 150)).get(PUBLISHED), 50);
});

test("each end has a rate of its own", () => {
  const rates = new Rates();
  rates.update(at(1, 0, 0, 0));
  const table = rates.update(at(3, 200, 150, 50));
  assert.deepEqual([table.get(PUBLISHED), table.get(deliverKey("/t", "/b")), table.get(dropKey("/t", "/b"))], [100, 75, 25]);
});

test("old looks no longer count", () => {
  const rates = new Rates();
  for (const elapsed of [0, 1, 2, 3]) rates.update(at(elapsed, 0));
  for (const elapsed of [4, 5, 6]) rates.update(at(elapsed, (elapsed - 3) * 10));
  assert.equal(rates.update(at(7, 40)).get(PUBLISHED), 10);
});

test("time that jumps beyond the window still gives a rate", () => {
  const rates = new Rates();
  rates.update(at(10, 0));
  assert.equal(rates.update(at(110, 1000)).get(PUBLISHED), 10);
});

test("time that stands still keeps the rates", () => {
  const rates = new Rates();
  rates.update(at(1, 0));
  rates.update(at(2, 10));
  assert.equal(rates.update(at(2, 10)).get(PUBLISHED), 10);
  assert.equal(rates.update(at(null, 10)).get(PUBLISHED), 10);
});

test("a restarted node has no rate at first", () => {
  const rates = new Rates();
  rates.update(at(1, 500));
  assert.equal(rates.update(at(2, 3)).get(PUBLISHED), undefined);
});

test("another run begins anew", () => {
  const rates = new Rates();
  rates.update(at(100, 0));
  assert.equal(rates.update(at(1, 500)).get(PUBLISHED), undefined);
});

test("ends without counts have no rate", () => {
  const rates = new Rates();
  rates.update(at(1, null));
  assert.equal(rates.update(at(2, null)).get(PUBLISHED), undefined);
});

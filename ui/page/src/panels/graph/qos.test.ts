import assert from "node:assert/strict";
import { test } from "node:test";
import { qosRows } from "./qos";

const QOS = { reliability: "reliable", durability: "transient_local", depth: 5 };
const misfits = (...of: Parameters<typeof qosRows>) => qosRows(...of).filter(({ fits }) => !fits).map(({ name }) => name);

test("the same on both ends fits", () => {
  assert.deepEqual(misfits(QOS, QOS), []);
});

test("less than is requested does not fit", () => {
  const weak = { reliability: "best_effort", durability: "volatile", depth: 1 };
  assert.deepEqual(misfits(weak, QOS), ["reliability", "durability"]);
  assert.deepEqual(misfits(QOS, weak), []);
  assert.deepEqual(misfits(weak, weak), []);
});

test("a longer deadline than requested does not fit", () => {
  assert.deepEqual(misfits({ ...QOS, deadline_s: 0.2 }, { ...QOS, deadline_s: 0.1 }), ["deadline"]);
  assert.deepEqual(misfits(QOS, { ...QOS, deadline_s: 0.1 }), ["deadline"]);
  assert.deepEqual(misfits({ ...QOS, deadline_s: 0.1 }, QOS), []);
});

test("periods and words are written for people", () => {
  const row = qosRows({ ...QOS, lifespan_s: 0.5 }, QOS).find(({ name }) => name === "lifespan");
  assert.deepEqual([row?.offered, row?.requested], ["500 ms", "–"]);
  assert.equal(qosRows(QOS, QOS)[1]?.offered, "transient local");
});

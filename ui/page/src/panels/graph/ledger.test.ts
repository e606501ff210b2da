import assert from "node:assert/strict";
import { test } from "node:test";
import { subscription } from "../../testing/graphs";
import { ledgerOf } from "./ledger";

test("the ledgers of several subscriptions add up", () => {
  const ledger = ledgerOf([
    subscription("/a", { published: 10, delivered: 7, dropped: 2, queued: 1, reasons: { expired: 2 } }),
    subscription("/a", { published: 5, delivered: 2, dropped: 3, queued: 0, reasons: { overflow: 3, matched: 0 } }),
  ]);
  assert.deepEqual(ledger, {
    published: 15,
    delivered: 9,
    dropped: 5,
    queued: 1,
    reasons: [["overflow", 3], ["expired", 2]],
  });
});

test("another program keeps no ledger", () => {
  assert.equal(ledgerOf([subscription("/a", { published: null, delivered: null, dropped: null, queued: null })]), null);
  assert.equal(ledgerOf([]), null);
});

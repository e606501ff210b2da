import assert from "node:assert/strict";
import { test } from "node:test";
import { graph, node, publisher, subscription, topic } from "../testing/graphs";
import { endRows, failures } from "./end_table";

test("topics with drops come first", () => {
  const ends = (dropped: number) => [subscription("/b", { published: 10, delivered: 10 - dropped, dropped })];
  const all = graph({
    topics: [
      topic("/a", { published: 10, publishers: [publisher("/x")], subscriptions: ends(0) }),
      topic("/z", { published: 10, subscriptions: ends(3) }),
      topic("/alone", { published: 4 }),
      topic("/rosout", { published: 99 }),
    ],
  });
  assert.deepEqual(endRows(all), [
    { topic: "/z", published: 10, delivered: 7, dropped: 3 },
    { topic: "/a", published: 10, delivered: 10, dropped: 0 },
    { topic: "/alone", published: 4, delivered: null, dropped: null },
  ]);
});

test("a failure names its node", () => {
  const all = graph({ nodes: [node("/a", { failures: ["ValueError: no"] }), node("/b", { failures: ["/b: it ended"] })] });
  assert.deepEqual(failures(all), ["/a: ValueError: no", "/b: it ended"]);
});

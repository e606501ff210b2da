import assert from "node:assert/strict";
import test from "node:test";
import { search, type Section } from "./search";

const SECTIONS: readonly Section[] = [
  { address: "a.html", chapter: "A", heading: "A", text: "A queue has a depth. The depth counts messages." },
  { address: "a.html#q", chapter: "A", heading: "Queues", text: "What waits has a depth." },
  { address: "b.html", chapter: "B", heading: "B", text: "Nothing of it." },
];

test("a section has every word, and headings count more", () => {
  assert.deepEqual(search(SECTIONS, "QUEUE depth").map(({ section }) => section.address), ["a.html#q", "a.html"]);
  assert.deepEqual(search(SECTIONS, "queue missing"), []);
  assert.deepEqual(search(SECTIONS, "  "), []);
});

test("an excerpt has the word in its middle", () => {
  const [hit] = search(SECTIONS, "waits");
  assert.deepEqual(hit?.excerpt, ["What ", "waits", " has a depth.…"]);
});

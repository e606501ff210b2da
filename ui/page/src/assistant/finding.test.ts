import assert from "node:assert/strict";
import test from "node:test";
import { folded, placeIn } from "./finding";

test("spaces are folded, and places kept", () => {
  assert.deepEqual(folded("  a \n b"), { text: "a b", places: [2, 3, 6] });
});

test("a text is found whatever its spaces and marks", () => {
  const page = "One.\n  The processor\n makes   sense of them. Three.";
  const place = placeIn(page, "The `processor` makes **sense** of them.");
  assert.equal(page.slice(place?.from, place?.to), "The processor\n makes   sense of them.");
  assert.equal(placeIn(page, "Four."), undefined);
  assert.equal(placeIn(page, " \n"), undefined);
});

test("marks that the page shows are found as they are", () => {
  assert.deepEqual(placeIn("2 * 3 = `six`", "2 * 3"), { from: 0, to: 5 });
});

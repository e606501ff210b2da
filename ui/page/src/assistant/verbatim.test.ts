import assert from "node:assert/strict";
import test from "node:test";
import { piecesOf } from "./verbatim";

test("code and emphasis are pieces, links their text", () => {
  assert.deepEqual(piecesOf("A **b** `c` [d](e.md) <!-- f -->"), [
    { kind: "text", text: "A " },
    { kind: "strong", text: "b" },
    { kind: "text", text: " " },
    { kind: "code", text: "c" },
    { kind: "text", text: " " },
    { kind: "text", text: "d" },
    { kind: "text", text: " " },
  ]);
});

test("markup is text", () => {
  const markup = "<img src=x onerror=alert(1)>";
  assert.deepEqual(piecesOf(markup), [{ kind: "text", text: markup }]);
});

test("marks without an end stay as they are", () => {
  assert.deepEqual(piecesOf("2 ** 3 and `x"), [{ kind: "text", text: "2 ** 3 and `x" }]);
});

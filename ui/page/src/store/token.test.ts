import assert from "node:assert/strict";
import { test } from "node:test";
import { splitToken } from "./token";

test("the token leaves the fragment, the layout stays", () => {
  assert.deepEqual(splitToken("#token=a%2Bb&layout=%7B%7D"), { token: "a+b", fragment: "#layout=%7B%7D" });
});

test("a fragment without a token keeps all of it", () => {
  assert.deepEqual(splitToken("#layout=1"), { token: null, fragment: "#layout=1" });
  assert.deepEqual(splitToken(""), { token: null, fragment: "" });
  assert.deepEqual(splitToken("#token=x"), { token: "x", fragment: "" });
});

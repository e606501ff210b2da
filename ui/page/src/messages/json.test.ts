import assert from "node:assert/strict";
import test from "node:test";
import { jsonText, parseJson } from "./json";

test("an integer beyond 2^53 keeps each digit", () => {
  assert.deepEqual(parseJson('{"a":9223372036854775807,"b":[-9007199254740993],"c":"9223372036854775807","d":9007199254740991}'), {
    a: 9223372036854775807n,
    b: [-9007199254740993n],
    c: "9223372036854775807",
    d: 9007199254740991,
  });
});

test("long decimals and texts stay what they are", () => {
  const text = '{"pi":3.14159265358979312,"e":12345678901234567e3,"t":"say \\"12345678901234567890\\" twice"}';
  assert.deepEqual(parseJson(text), JSON.parse(text));
});

test("text that is no JSON is refused", () => {
  for (const text of ["", "{", "12345678901234567 1", '{"a":12345678901234567"}', "01234567890123456789"]) {
    assert.throws(() => parseJson(text), SyntaxError, text);
  }
});

test("a written message is read back as it was", () => {
  const message = { large: 2n ** 63n - 1n, small: 5, text: 'a"b\\', list: [1.5, -1n * 2n ** 62n] };
  assert.deepEqual(parseJson(jsonText(message)), message);
  assert.deepEqual(parseJson(jsonText(message, 2)), message);
});

test("what JSON lacks is written as busflow does", () => {
  assert.equal(jsonText([NaN, Infinity, -Infinity, new Float64Array([1, NaN]), new BigInt64Array([3n])]), '[".nan",".inf","-.inf",[1,".nan"],[3]]');
});

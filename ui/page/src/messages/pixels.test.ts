import assert from "node:assert/strict";
import test from "node:test";
import { compressedOf, pixelsOf } from "./pixels";

const image = (encoding: string, bytes: readonly number[], fields: object = {}): object => ({
  width: 2,
  height: 2,
  encoding,
  is_bigendian: 0,
  step: bytes.length / 2,
  data: Uint8Array.from(bytes),
  ...fields,
});
const COLOURS = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12];

test("colours stand in the order of RGBA", () => {
  assert.deepEqual([...pixelsOf(image("rgb8", COLOURS)).rgba], [1, 2, 3, 255, 4, 5, 6, 255, 7, 8, 9, 255, 10, 11, 12, 255]);
  assert.deepEqual([...pixelsOf(image("bgr8", COLOURS)).rgba.slice(0, 8)], [3, 2, 1, 255, 6, 5, 4, 255]);
  assert.deepEqual([...pixelsOf(image("mono8", [7, 8, 9, 10])).rgba.slice(4)], [8, 8, 8, 255, 9, 9, 9, 255, 10, 10, 10, 255]);
});

test("bytes after a row are left out", () => {
  const padded = image("mono8", [1, 2, 99, 3, 4, 99]);
  assert.deepEqual([...pixelsOf(padded).rgba].filter((_, at) => at % 4 === 0), [1, 2, 3, 4]);
});

test("16 bits are scaled to what is measured", () => {
  const little = pixelsOf(image("16UC1", [0, 0, 0xe8, 3, 0xd0, 7, 0xdc, 5]));
  assert.deepEqual([...little.rgba].filter((_, at) => at % 4 === 0), [0, 0, 255, 128]);
  assert.equal(little.range, "1000 black, 2000 white");
  const big = pixelsOf(image("mono16", [0, 0, 3, 0xe8, 7, 0xd0, 5, 0xdc], { is_bigendian: 1 }));
  assert.deepEqual(big.rgba, little.rgba);
  assert.equal(pixelsOf(image("16UC1", new Array<number>(8).fill(0))).range, "all 0");
});

test("what is no such image says why", () => {
  assert.throws(() => pixelsOf({}), /no image/);
  assert.throws(() => pixelsOf(image("bayer_rggb8", [1, 2, 3, 4])), /"bayer_rggb8" is not shown/);
  assert.throws(() => pixelsOf(image("rgb8", COLOURS, { height: 3 })), /too short/);
  assert.throws(() => pixelsOf(image("rgb8", COLOURS, { step: 3 })), /too short/);
  assert.throws(() => pixelsOf(image("mono8", [1], { width: 100_000, height: 100_000, step: 100_000 })), /more than the page draws/);
  assert.throws(() => pixelsOf(image("mono8", [1], { width: -1 })), /no image/);
});

test("a compressed image is known by its bytes", () => {
  assert.equal(compressedOf({ format: "svg", data: Uint8Array.of(0xff, 0xd8, 0xff, 0xe0) }).type, "image/jpeg");
  assert.equal(compressedOf({ data: Uint8Array.of(0x89, 0x50, 0x4e, 0x47, 0x0d) }).type, "image/png");
  assert.throws(() => compressedOf({ format: "png", data: new TextEncoder().encode("<svg onload=alert(1)>") }), /neither JPEG nor PNG/);
  assert.throws(() => compressedOf({ data: "text" }), /no image/);
});

test("a small file of a huge image is refused", () => {
  const png = [0x89, 0x50, 0x4e, 0x47, 13, 10, 26, 10, 0, 0, 0, 13, 73, 72, 68, 82, 0, 1, 0, 0, 0, 1, 0, 0];
  assert.throws(() => compressedOf({ data: Uint8Array.from(png) }), /65536 × 65536 is more/);
  const jpeg = [0xff, 0xd8, 0xff, 0xe0, 0, 4, 1, 2, 0xff, 0xc2, 0, 11, 8, 0x80, 0, 0xff, 0xff, 1, 1, 0x11, 0];
  assert.throws(() => compressedOf({ data: Uint8Array.from(jpeg) }), /65535 × 32768 is more/);
});

import assert from "node:assert/strict";
import test from "node:test";
import { headerStampNs, secondsBetween, stampAfter, stampNs, stampText } from "./stamps";

const NOW = 1_795_501_648_123_456_789n;
const withStamp = (sec: number, nanosec: number): unknown => ({ header: { stamp: { sec, nanosec }, frame_id: "" } });

test("the header's stamp is exact", () => {
  assert.equal(headerStampNs(withStamp(1_795_501_648, 123_456_789)), NOW);
});

test("without a set header the publish stamp holds", () => {
  for (const message of [{}, null, { header: 1 }, { header: { stamp: { sec: "1", nanosec: 0 } } }, withStamp(0, 0)]) {
    assert.equal(stampNs(message, NOW), NOW);
  }
  assert.equal(headerStampNs(withStamp(0, 0)), undefined);
});

test("a header of another clock is not used", () => {
  assert.equal(stampNs(withStamp(1_795_501_640, 0), NOW), 1_795_501_640_000_000_000n);
  assert.equal(stampNs(withStamp(12, 0), NOW), NOW);
});

test("seconds since an origin keep nanoseconds", () => {
  for (let apart = 4_470_967_502_952_117n; apart > 0n; apart /= 3n) {
    assert.equal(stampAfter(NOW, secondsBetween(NOW, NOW + apart)), NOW + apart);
  }
  assert.equal(secondsBetween(NOW, NOW - 1_500_000_000n), -1.5);
});

test("a stamp is a time of day, or seconds", () => {
  assert.match(stampText(NOW), /^\d\d:\d\d:28\.123$/);
  assert.equal(stampText(12_345_678_901n), "12.345 s");
});

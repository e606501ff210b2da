import assert from "node:assert/strict";
import { test } from "node:test";
import { fit, pan, READABLE, readable, reveal, zoom } from "./viewport";

const SCREEN = { width: 800, height: 600 };

test("a large drawing is fitted into the middle", () => {
  const view = fit({ width: 1600, height: 600 }, SCREEN);
  assert.deepEqual(view, { x: 0, y: 150, scale: 0.5 });
});

test("a small drawing is hardly enlarged", () => {
  assert.equal(fit({ width: 100, height: 100 }, SCREEN).scale, 1.25);
});

test("a drawing too large to read shows its beginning", () => {
  const start = { x: 24, y: 1480, width: 100, height: 40 };
  assert.deepEqual(readable({ width: 4000, height: 300 }, SCREEN, start), { x: 0, y: (600 - 300 * READABLE) / 2, scale: READABLE });
  assert.deepEqual(readable({ width: 4000, height: 3000 }, SCREEN, start), { x: 0, y: 300 - 1500 * READABLE, scale: READABLE });
  assert.deepEqual(readable({ width: 800, height: 300 }, SCREEN, start), fit({ width: 800, height: 300 }, SCREEN));
});

test("zooming keeps the point under the pointer", () => {
  const before = { x: 10, y: 20, scale: 1 };
  const at = { x: 300, y: 200 };
  const after = zoom(before, 2, at);
  assert.equal((at.x - after.x) / after.scale, (at.x - before.x) / before.scale);
  assert.equal((at.y - after.y) / after.scale, (at.y - before.y) / before.scale);
});

test("the scale has limits on both sides", () => {
  const view = { x: 0, y: 0, scale: 1 };
  assert.equal(zoom(view, 1e6, { x: 0, y: 0 }).scale, 3);
  assert.equal(zoom(view, 1e-6, { x: 0, y: 0 }).scale, 0.08);
});

test("a box outside the screen is moved into it", () => {
  const box = { x: 2000, y: -50, width: 100, height: 40 };
  const view = reveal({ x: 0, y: 0, scale: 1 }, box, SCREEN);
  assert.equal(box.x + box.width + view.x, SCREEN.width - 24);
  assert.equal(box.y + view.y, 24);
});

test("a box that is seen moves nothing", () => {
  const view = pan({ x: 0, y: 0, scale: 1 }, 5, 6);
  assert.deepEqual(reveal(view, { x: 100, y: 100, width: 50, height: 50 }, SCREEN), view);
});

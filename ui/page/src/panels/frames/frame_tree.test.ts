import assert from "node:assert/strict";
import { test } from "node:test";
import { FrameTree, rateOf } from "./frame_tree";

const HALF = Math.SQRT1_2;

function transform(parent: string, child: string, sec = 0, rotation = { x: 0, y: 0, z: HALF, w: HALF }) {
  const header = { frame_id: parent, stamp: { sec, nanosec: 0 } };
  return { header, child_frame_id: child, transform: { translation: { x: 1, y: 2, z: 3 }, rotation } };
}

function treeOf(...transforms: readonly unknown[]): FrameTree {
  const tree = new FrameTree();
  tree.take({ transforms }, false, 0n);
  return tree;
}

const drawn = (tree: FrameTree): readonly string[] => tree.rows().map(({ name, depth }) => `${"  ".repeat(depth)}${name}`);

test("each frame stands below its parent", () => {
  const tree = treeOf(transform("base", "left"), transform("map", "odom"), transform("base", "arm"), transform("odom", "base"));
  assert.deepEqual(drawn(tree), ["map", "  odom", "    base", "      arm", "      left"]);
  assert.equal(tree.rows()[0]?.frame, undefined);
});

test("a frame has the place and angles of its last transform", () => {
  const frame = treeOf(transform("map", "odom")).rows()[1]?.frame;
  assert.ok(frame !== undefined);
  assert.deepEqual(frame.translation, [1, 2, 3]);
  assert.deepEqual(frame.rotation.map((each) => Math.round((each * 180) / Math.PI)), [0, 0, 90]);
});

test("the rate is that of the stamps", () => {
  const tree = treeOf(...[1, 2, 3, 4].map((sec) => transform("map", "odom", sec)));
  const frame = tree.rows()[1]?.frame;
  assert.equal(frame && rateOf(frame), 1);
});

test("a frame in a circle is drawn once", () => {
  assert.deepEqual(drawn(treeOf(transform("b", "a"), transform("a", "b"), transform("a", "c"))), ["a", "  b", "  c"]);
});

test("a frame with another parent names the former one", () => {
  const tree = treeOf(transform("map", "base"), transform("odom", "base"), transform("map", "odom"));
  const base = tree.rows().find(({ name }) => name === "base")?.frame;
  assert.deepEqual([base?.parent, base?.formerParents], ["odom", ["map"]]);
});

test("what moves is forgotten where time goes back", () => {
  const tree = treeOf(transform("base", "arm"));
  tree.take({ transforms: [transform("base", "camera")] }, true, 0n);
  tree.take({ transforms: [transform("map", "base")] }, false, 60_000_000_000n);
  tree.take({ transforms: [transform("odom", "base")] }, false, 5n);
  assert.deepEqual(drawn(tree), ["odom", "  base", "    camera"]);
});

test("what is no transform is left out", () => {
  const tree = treeOf(7, null, {}, transform("", ""), { ...transform("a", "b"), header: {} }, transform("a", "a"));
  tree.take("text", false, 0n);
  tree.take({ transforms: 7 }, true, 0n);
  assert.deepEqual(tree.rows(), []);
});

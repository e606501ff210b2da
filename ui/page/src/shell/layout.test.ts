import assert from "node:assert/strict";
import { test } from "node:test";
import { addPanel, fragmentOf, readFragment, readLayout, removePanel, setSettings, shownIn, type Layout } from "./layout";

const KINDS = ["graph", "log", "plot"];
const FIRST: Layout = { view: "graph", views: {} };
const kindsOf = (layout: Layout) => shownIn(layout).map((column) => column.map(({ kind }) => kind));

test("the first view has no fragment", () => {
  assert.equal(fragmentOf(FIRST, "graph"), "");
  assert.deepEqual(readFragment("", KINDS), FIRST);
});

test("a layout comes back from its fragment", () => {
  const layout = setSettings(addPanel(addPanel(FIRST, "log"), "plot"), 0, 0, { selected: "node /<b>&ä" });
  assert.deepEqual(readFragment(fragmentOf(layout, "graph"), KINDS), layout);
  assert.deepEqual(kindsOf(layout), [["graph"], ["log"], ["plot"]]);
});

test("the fragment may hold other things", () => {
  const fragment = fragmentOf({ view: "log", views: {} }, "graph");
  assert.equal(readFragment(`#x=1&${fragment.slice(1)}`, KINDS).view, "log");
});

test("what is no layout becomes the first view", () => {
  for (const fragment of ["#layout=", "#layout=%", "#layout=[]", "#layout=null", '#layout={"view":"<script>"}']) {
    assert.deepEqual(readFragment(fragment, KINDS), FIRST, fragment);
  }
});

test("unknown panels and wrong settings are left out", () => {
  const data = { view: "log", views: { log: [[{ kind: "evil" }, { kind: "log", settings: 7 }], "x"], evil: [[{ kind: "log" }]] } };
  assert.deepEqual(readLayout(data, KINDS), { view: "log", views: { log: [[{ kind: "log", settings: {} }]] } });
});

test("a view holds at most twelve panels", () => {
  let layout = FIRST;
  for (let added = 0; added < 30; added += 1) layout = addPanel(layout, "log");
  assert.equal(kindsOf(layout).flat().length, 12);
  const many = { view: "log", views: { log: [Array.from({ length: 99 }, () => ({ kind: "log" }))] } };
  assert.equal(shownIn(readLayout(many, KINDS)).flat().length, 12);
});

test("each view keeps its own panels", () => {
  const layout = { ...addPanel(FIRST, "plot"), view: "log" };
  assert.deepEqual(kindsOf(layout), [["log"]]);
  assert.deepEqual(kindsOf({ ...layout, view: "graph" }), [["graph"], ["plot"]]);
});

test("the last panel that is closed comes back alone", () => {
  const layout = removePanel(removePanel(addPanel(FIRST, "log"), 0, 0), 0, 0);
  assert.deepEqual(layout, FIRST);
});

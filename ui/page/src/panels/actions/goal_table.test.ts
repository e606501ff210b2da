import assert from "node:assert/strict";
import { test } from "node:test";
import type { SentGoal } from "../../store/goals";
import { GoalTable, type GoalRow } from "./goal_table";

const ID = (number: number): string => `${String(number).padStart(8, "0")}-0000-0000-0000-000000000000`;
const goalId = (number: number) => ({ uuid: Uint8Array.from({ length: 16 }, (_, at) => (at === 3 ? number : 0)) });
const status = (...goals: readonly (readonly [number, number])[]) => ({
  status_list: goals.map(([number, state]) => ({ goal_info: { goal_id: goalId(number), stamp: { sec: number, nanosec: 5 } }, status: state })),
});
const sent = (key: number, changed: Partial<SentGoal> = {}): SentGoal => ({
  ...{ key, action: "/a", sentMs: key, id: null, phase: "sending", state: null, result: null, reason: "" },
  ...changed,
});

function table(): GoalTable {
  let now = 100;
  return new GoalTable(() => (now += 1));
}

const states = (rows: readonly GoalRow[]) => rows.map(({ id, state, isActive }) => [id, state, isActive]);

test("goals of others have their states and feedback, newest first", () => {
  const goals = table();
  goals.takeStatus(status([1, 4]));
  goals.takeStatus(status([1, 4], [2, 2]));
  goals.takeFeedback({ goal_id: goalId(2), feedback: { left: 3 } });
  goals.takeFeedback({ goal_id: goalId(2), feedback: { left: 2 } });
  const rows = goals.rows([], true);
  assert.deepEqual(states(rows), [[ID(2), "executing", true], [ID(1), "succeeded", false]]);
  assert.deepEqual(rows[0]?.feedback, { message: { left: 2 }, count: 2 });
  assert.deepEqual([rows[0].acceptedNs, rows[0].isOwn], [2_000_000_005, false]);
});

test("an ended goal stays after its server has forgotten it", () => {
  const goals = table();
  goals.takeStatus(status([1, 5]));
  goals.takeStatus(status());
  assert.deepEqual(states(goals.rows([], true)), [[ID(1), "canceled", false]]);
});

test("a goal that its server no longer has is gone", () => {
  const goals = table();
  goals.takeStatus(status([1, 2], [2, 2]));
  assert.deepEqual(states(goals.rows([], false)).map(([, state]) => state), ["gone", "gone"]);
  goals.takeStatus(status([2, 2]));
  assert.deepEqual(states(goals.rows([], true)), [[ID(2), "executing", true], [ID(1), "gone", false]]);
});

test("an own goal is one row from sending it to its end", () => {
  const goals = table();
  assert.deepEqual(states(goals.rows([sent(7)], true)), [[null, "sending", false]]);
  assert.deepEqual(states(goals.rows([sent(7, { id: ID(1), phase: "going" })], true)), [[ID(1), "accepted", true]]);
  goals.takeStatus(status([1, 3]));
  const going = sent(7, { id: ID(1), phase: "going" });
  assert.deepEqual(states(goals.rows([going], true)), [[ID(1), "canceling", true]]);
  const ended = sent(7, { id: ID(1), phase: "ended", state: 5, result: { angle: 1 }, reason: "canceled" });
  const [row, ...others] = goals.rows([ended], true);
  assert.deepEqual([row?.key, row?.state, row?.isActive, row?.result, row?.isOwn], ["sent 7", "canceled", false, { angle: 1 }, true]);
  assert.deepEqual(others, []);
});

test("a goal that was not accepted has the reason", () => {
  const [row] = table().rows([sent(7, { phase: "failed", reason: "no joint 'tail'" })], true);
  assert.deepEqual([row?.state, row?.reason, row?.isActive], ["not accepted", "no joint 'tail'", false]);
});

test("a goal whose time was over is canceled, with the reason", () => {
  const goals = table();
  goals.takeStatus(status([1, 5]));
  const [row] = goals.rows([sent(7, { id: ID(1), phase: "failed", reason: "it did not end within 2 s" })], true);
  assert.deepEqual([row?.state, row?.reason], ["canceled", "it did not end within 2 s"]);
});

test("messages of another shape change nothing", () => {
  const goals = table();
  for (const wrong of [null, 3, {}, { status_list: [{}, { goal_info: { goal_id: { uuid: [1] } } }] }]) {
    goals.takeStatus(wrong);
    goals.takeFeedback(wrong);
  }
  assert.deepEqual(goals.rows([], true), []);
});

test("the oldest goals are forgotten", () => {
  const goals = table();
  for (let number = 0; number < 250; number += 1) goals.takeStatus(status([number, 4]));
  const rows = goals.rows([], true);
  assert.equal(rows.length, 100);
  assert.equal(rows[0]?.id?.slice(0, 8), (249).toString(16).padStart(8, "0"));
});

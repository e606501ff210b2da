import assert from "node:assert/strict";
import { test } from "node:test";
import { endSentence, runState } from "./run_state";

const OPEN = { phase: "open" } as const;
const RUN = { name: "lab1" };

test("an end is said over every state of the connection", () => {
  const ended = { ...RUN, ended: {} };
  for (const phase of ["open", "connecting"] as const) assert.equal(runState({ phase }, ended, "run").word, "ended");
  assert.deepEqual(runState(OPEN, { ...RUN, ended: { errors: ["/a: no"] } }, "run"), { tone: "bad", word: "ended" });
  assert.deepEqual(runState(OPEN, { ...RUN, ended: { was_killed: true } }, "run"), { tone: "bad", word: "killed" });
});

test("the sentence of an end says no more than is known", () => {
  assert.equal(endSentence("lab1", {}), "The run lab1 has ended.");
  assert.equal(endSentence("lab1", { elapsed_s: 75, was_killed: true }), "The run lab1 has ended after 1:15: its process was killed.");
});

test("a run that does not answer is not running", () => {
  assert.deepEqual(runState(OPEN, { ...RUN, silent_s: 1 }, "run"), { tone: "bad", word: "no answer" });
  assert.deepEqual(runState(OPEN, RUN, "run"), { tone: "good", word: "running" });
});

test("a lost connection and a wrong token are said", () => {
  assert.equal(runState({ phase: "waiting", reason: "" }, RUN, "run").word, "not connected");
  assert.equal(runState({ phase: "refused", reason: "" }, { ...RUN, ended: {} }, "run").word, "refused");
});

test("a recording does not run", () => {
  assert.equal(runState(OPEN, null, "recording").word, "recording");
});

import assert from "node:assert/strict";
import { test } from "node:test";
import { QuestionError, Questions } from "./questions";

function asked() {
  const sent: Record<string, unknown>[] = [];
  const questions = new Questions((operation) => sent.push(operation));
  questions.opened();
  return { questions, sent };
}

const NODE = { node: "/a" };

test("an answer finds its question", async () => {
  const { questions, sent } = asked();
  const first = questions.ask("parameters", NODE);
  const second = questions.ask("order", { ...NODE, order: "stop" });
  questions.handle({ op: "busflow/answer", id: 2, answer: { state: "stopping" } });
  questions.handle({ op: "busflow/answer", id: 1, answer: { parameters: [] } });
  assert.deepEqual(await first, { parameters: [] });
  assert.deepEqual(await second, { state: "stopping" });
  assert.deepEqual(sent[0], { op: "busflow/ask", id: 1, question: "parameters", arguments: NODE });
});

test("a refusal comes in the run's words", async () => {
  const { questions } = asked();
  const answer = questions.ask("parameters", NODE);
  questions.handle({ op: "busflow/answer", id: 1, error: "there is no node /a" });
  await assert.rejects(answer, new QuestionError("there is no node /a"));
});

test("a question has a time limit", async (context) => {
  context.mock.timers.enable({ apis: ["setTimeout"] });
  const { questions } = asked();
  const answer = questions.ask("parameters", NODE, 2000);
  context.mock.timers.tick(2000);
  await assert.rejects(answer, /No answer within 2 s/);
});

test("an end of the connection ends all questions", async () => {
  const { questions } = asked();
  const answer = questions.ask("parameters", NODE);
  questions.ended();
  await assert.rejects(answer, /connection ended/);
  await assert.rejects(questions.ask("parameters", NODE), /no connection/);
});

test("what is followed is followed again after a reconnection", () => {
  const { questions, sent } = asked();
  const seen: [unknown, boolean][] = [];
  questions.follow("log", (answer, isFirst) => seen.push([answer.lines.length, isFirst]));
  const update = { op: "busflow/update", question: "log", answer: { lines: [] } } as const;
  questions.handle(update);
  questions.handle(update);
  questions.ended();
  questions.opened();
  questions.handle(update);
  assert.deepEqual(seen, [[0, true], [0, false], [0, true]]);
  assert.deepEqual(sent.map(({ on }) => on), [true, true]);
});

test("the last who leaves ends the following", () => {
  const { questions, sent } = asked();
  const ends = [questions.follow("graph", () => undefined), questions.follow("graph", () => undefined)];
  ends.forEach((end) => end());
  assert.deepEqual(sent.at(-1), { op: "busflow/follow", question: "graph", on: false });
  assert.equal(sent.filter(({ on }) => on === true).length, 2);
});

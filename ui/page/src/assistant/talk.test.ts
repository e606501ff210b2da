import assert from "node:assert/strict";
import test from "node:test";
import type { AssistantAnswer } from "../connection/answers";
import { Talk, type About, type TextStorage } from "./talk";

const ABOUT: About = { chapter: "lab1.md", title: "Lab 1", selection: "text", isCut: false, isWholePage: false };
const ANSWER: AssistantAnswer = {
  answer: "one two", answered: true, scope: "page", reason: "", citations: [], engine: "extractive", ms: 1,
};

function keeping(): TextStorage & { readonly kept: Map<string, string> } {
  const kept = new Map<string, string>();
  return { kept, getItem: (key) => kept.get(key) ?? null, setItem: (key, value) => void kept.set(key, value) };
}

type Ask = Parameters<Talk["ask"]>[0]["ask"];

test("parts are shown until the answer comes", async () => {
  const talk = new Talk(keeping());
  const seen: string[] = [];
  const ask = ((_question: string, args: unknown, _limit: number, onPart: (part: unknown) => void) => {
    assert.deepEqual(args, { question: "how?", selection: "text", chapter: "lab1.md" });
    for (const part of [{ text: "one " }, { text: 7 }, { text: "t" }]) {
      onPart(part);
      seen.push(talk.exchanges.value[0]!.text);
    }
    return Promise.resolve(ANSWER);
  }) as unknown as Ask;
  await talk.ask({ ask }, "how?", ABOUT);
  assert.deepEqual(seen, ["one ", "one ", "one t"]);
  assert.deepEqual(talk.exchanges.value.map(({ phase, text }) => [phase, text]), [["answered", "one two"]]);
});

test("a failure is an answer in words", async () => {
  const talk = new Talk(keeping());
  await talk.ask({ ask: () => Promise.reject(new Error("no assistant runs")) }, "how?", ABOUT);
  assert.deepEqual(talk.exchanges.value.map(({ phase, text }) => [phase, text]), [["failed", "no assistant runs"]]);
});

test("the talk of a tab is kept, without what was under way", () => {
  const place = keeping();
  void new Talk(place).ask({ ask: (() => new Promise(() => undefined)) as unknown as Ask }, "how?", ABOUT);
  const again = new Talk(place).exchanges.value;
  assert.deepEqual(again.map(({ question, phase }) => [question, phase]), [["how?", "failed"]]);
  place.kept.set("busflow-talk", "{");
  assert.deepEqual(new Talk(place).exchanges.value, []);
});

test("a full store does not end the talk", async () => {
  const full: TextStorage = { getItem: () => null, setItem: () => { throw new Error("full"); } };
  const talk = new Talk(full);
  await talk.ask({ ask: () => Promise.resolve(ANSWER) }, "how?", ABOUT);
  assert.equal(talk.exchanges.value.length, 1);
});

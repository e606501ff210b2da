import assert from "node:assert/strict";
import test from "node:test";
import { signal } from "@preact/signals";
import type { Channel } from "../connection/protocol";
import type { Listener } from "../connection/topics";
import { Receiver, type Received } from "./receiver";

const CHANNEL: Channel = { id: 1, topic: "/a", encoding: "json", schemaName: "A", schema: "", schemaEncoding: "jsonschema" };
const SECOND = 1_000_000_000n;

/** Topics without a connection: what is sent reaches the listeners at once. */
class SentTopics {
  readonly listeners = new Set<Listener>();
  readonly channels = signal<ReadonlyMap<string, Channel>>(new Map([["/a", CHANNEL]]));

  listen(_topic: string, listener: Listener): () => void {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }

  send(json: string, seconds = 1, channel = CHANNEL): void {
    const data = new DataView(new TextEncoder().encode(json).buffer);
    for (const listener of this.listeners) listener({ channel, stampNs: BigInt(seconds) * SECOND, data });
  }
}

test("a message is decoded once for all listeners", () => {
  const [topics, seen] = [new SentTopics(), [] as Received[]];
  const receiver = new Receiver(topics);
  receiver.follow("/a", (received) => seen.push(received));
  receiver.follow("/a", (received) => seen.push(received));
  topics.send('{"x":1}');
  assert.equal(topics.listeners.size, 1);
  assert.equal(seen[0], seen[1]);
  assert.deepEqual(seen[0]?.reading.fault === undefined && seen[0]?.reading.message, { x: 1 });
  assert.equal(seen[0]?.reading, seen[0]?.reading);
});

test("a topic is given up with its last listener", () => {
  const topics = new SentTopics();
  const receiver = new Receiver(topics);
  const [first, second] = [receiver.follow("/a", () => undefined), receiver.follow("/a", () => undefined)];
  topics.send("1");
  first();
  assert.deepEqual([topics.listeners.size, receiver.past("/a", 9).length], [1, 1]);
  second();
  second();
  assert.deepEqual([topics.listeners.size, receiver.past("/a", 9).length, receiver.shown("/a")], [0, 0, undefined]);
});

test("what cannot be read is a sentence", () => {
  const topics = new SentTopics();
  const receiver = new Receiver(topics);
  receiver.follow("/a", () => undefined);
  topics.send("{");
  assert.match(receiver.shown("/a")?.reading.fault ?? "", /a message of \/a cannot be read/);
  topics.send("{}", 1, { ...CHANNEL, encoding: "protobuf" });
  assert.match(receiver.shown("/a")?.reading.fault ?? "", /encoded as protobuf/);
});

test("a moment of the past shows its messages", () => {
  const topics = new SentTopics();
  const receiver = new Receiver(topics);
  receiver.follow("/a", () => undefined);
  const shown = (): unknown => (receiver.shown("/a")?.reading as { message?: unknown } | undefined)?.message;
  for (let at = 1; at <= 5; at += 1) topics.send(String(at), at);
  receiver.lookAt(3n * SECOND);
  assert.equal(shown(), 3);
  for (let at = 6; at <= 500; at += 1) topics.send(String(at), at);
  receiver.lookAt(2n * SECOND);
  assert.equal(shown(), 2);
  receiver.lookAt(undefined);
  assert.equal(shown(), 500);
  assert.equal(receiver.past("/a", 3).length, 3);
});

test("a rate is that of the last seconds", () => {
  let nowMs = 0;
  const topics = new SentTopics();
  const receiver = new Receiver(topics, () => nowMs);
  receiver.follow("/a", () => undefined);
  topics.send("1");
  assert.equal(receiver.rateHz("/a"), undefined);
  for (; nowMs < 10_000; nowMs += 100) topics.send("1");
  for (; nowMs < 20_000; nowMs += 50) topics.send("1");
  assert.equal(receiver.rateHz("/a"), 20);
  nowMs += 5000;
  assert.equal(receiver.rateHz("/a"), 0);
});

test("a slow topic has a rate too", () => {
  let nowMs = 0;
  const topics = new SentTopics();
  const receiver = new Receiver(topics, () => nowMs);
  receiver.follow("/a", () => undefined);
  for (; nowMs <= 20_000; nowMs += 5000) topics.send("1");
  assert.equal(receiver.rateHz("/a"), 0.2);
});

test("no stamp is left when no topic is followed", () => {
  const topics = new SentTopics();
  const receiver = new Receiver(topics);
  const end = receiver.follow("/a", () => undefined);
  topics.send('{"x":1}', 3);
  assert.deepEqual([receiver.isFollowing.value, receiver.latestNs], [true, 3n * SECOND]);
  end();
  assert.deepEqual([receiver.isFollowing.value, receiver.latestNs], [false, undefined]);
});

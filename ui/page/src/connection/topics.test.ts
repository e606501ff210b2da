import assert from "node:assert/strict";
import { test } from "node:test";
import { Topics, type ReceivedMessage } from "./topics";

const CHANNEL = { id: 5, topic: "/imu", encoding: "cdr", schemaName: "x/msg/Imu", schema: "" };

function opened() {
  const sent: unknown[] = [];
  const frames: Uint8Array[] = [];
  const topics = new Topics({
    send: (operation) => sent.push(operation),
    sendBytes: (frame) => {
      frames.push(frame);
      return true;
    },
  });
  topics.opened();
  return { topics, sent, frames };
}

const message = (subscription: number) =>
  ({ op: "messageData", subscription, stampNs: 1n, data: new DataView(new ArrayBuffer(0)) }) as const;

test("several listeners share one subscription", () => {
  const { topics, sent } = opened();
  const seen: string[] = [];
  topics.handle({ op: "advertise", channels: [CHANNEL] });
  const ends = ["one", "two"].map((name) => topics.listen("/imu", () => seen.push(name)));
  topics.handle(message(1));
  assert.deepEqual(seen, ["one", "two"]);
  ends.forEach((end) => end());
  assert.deepEqual(sent, [
    { op: "subscribe", subscriptions: [{ id: 1, channelId: 5 }] },
    { op: "unsubscribe", subscriptionIds: [1] },
  ]);
});

test("a topic that comes later is received too", () => {
  const { topics } = opened();
  const seen: ReceivedMessage[] = [];
  topics.listen("/imu", (received) => seen.push(received));
  topics.handle({ op: "advertise", channels: [CHANNEL] });
  topics.handle(message(1));
  assert.equal(seen[0]?.channel, CHANNEL);
});

test("listeners go on after a reconnection", () => {
  const { topics, sent } = opened();
  let count = 0;
  topics.listen("/imu", () => (count += 1));
  topics.handle({ op: "advertise", channels: [CHANNEL] });
  topics.ended();
  topics.opened();
  topics.handle({ op: "advertise", channels: [{ ...CHANNEL, id: 9 }] });
  topics.handle(message(1));
  topics.handle(message(2));
  assert.equal(count, 1);
  assert.deepEqual(sent.at(-1), { op: "subscribe", subscriptions: [{ id: 2, channelId: 9 }] });
});

test("a channel that goes is no longer received", () => {
  const { topics } = opened();
  topics.listen("/imu", () => assert.fail("it has gone"));
  topics.handle({ op: "advertise", channels: [CHANNEL] });
  topics.handle({ op: "unadvertise", channelIds: [5] });
  topics.handle(message(1));
  assert.equal(topics.channels.value.size, 0);
});

test("a published topic is announced again, and can end", () => {
  const { topics, sent, frames } = opened();
  const publication = topics.advertise({ topic: "/cmd_vel", encoding: "cdr", schemaName: "geometry_msgs/msg/Twist" });
  assert.equal(publication.publish(Uint8Array.of(1)), true);
  topics.ended();
  assert.equal(publication.publish(Uint8Array.of(2)), false);
  topics.opened();
  publication.end();
  topics.ended();
  topics.opened();
  assert.equal(frames.length, 1);
  assert.deepEqual(sent.map((each) => (each as { op: string }).op), ["advertise", "advertise", "unadvertise"]);
});

/**
 * History: the messages of the last 60 s of each topic that is followed, encoded, within a number of bytes.
 *
 * Where they are too many, the topic with most bytes gives up its oldest: pictures do not push out numbers. While the
 * history is held it answers as it was at that moment, and goes on to keep what comes.
 */

/** Message as it is kept. */
export interface Kept {
  readonly stampNs: bigint;
  readonly data: { readonly byteLength: number };
}

interface Topic<Message> {
  messages: Message[];
  /** Place of the oldest; those before it are gone, and are cut off now and then. */
  start: number;
  bytes: number;
}

const JUMP_NS = 1_000_000_000n;
const MESSAGE_BYTES = 200; // what an object costs beside its payload

export class History<Message extends Kept> {
  readonly #topics = new Map<string, Topic<Message>>();
  #held: ReadonlyMap<string, readonly Message[]> | undefined;
  #bytes = 0;

  constructor(
    readonly spanNs: bigint,
    readonly mostBytes: number,
  ) {}

  /** Number of bytes that are kept. */
  get bytes(): number {
    return this.#bytes;
  }

  add(name: string, message: Message): void {
    const topic = this.#topics.get(name) ?? { messages: [], start: 0, bytes: 0 };
    this.#topics.set(name, topic);
    const newest = topic.messages.at(-1);
    if (newest !== undefined && message.stampNs < newest.stampNs - JUMP_NS) this.#cut(topic, message.stampNs);
    topic.messages.push(message);
    this.#count(topic, costOf(message));
    while ((topic.messages[topic.start]?.stampNs ?? message.stampNs) < message.stampNs - this.spanNs) this.#drop(topic);
    while (this.#bytes > this.mostBytes) this.#drop(this.#largest());
  }

  /** Returns the newest message of a topic that is not after a stamp; of all if none is given. */
  at(name: string, stampNs?: bigint): Message | undefined {
    const messages = this.messages(name);
    return stampNs === undefined ? messages.at(-1) : messages.findLast((each) => each.stampNs <= stampNs);
  }

  /** Returns the messages of a topic, oldest first. */
  messages(name: string): readonly Message[] {
    if (this.#held !== undefined) return this.#held.get(name) ?? [];
    const topic = this.#topics.get(name);
    return topic === undefined ? [] : topic.messages.slice(topic.start);
  }

  /** Drops what is kept of a topic. */
  forget(name: string): void {
    const topic = this.#topics.get(name);
    if (topic === undefined) return;
    this.#topics.delete(name);
    this.#bytes -= topic.bytes;
  }

  hold(): void {
    this.#held = new Map([...this.#topics].map(([name, { messages, start }]) => [name, messages.slice(start)]));
  }

  release(): void {
    this.#held = undefined;
  }

  /** Drops the messages after a stamp: time has jumped back, and they have not come yet. */
  #cut(topic: Topic<Message>, stampNs: bigint): void {
    topic.messages = topic.messages.slice(topic.start).filter((each) => each.stampNs <= stampNs);
    topic.start = 0;
    this.#count(topic, topic.messages.reduce((sum, each) => sum + costOf(each), 0) - topic.bytes);
  }

  #drop(topic: Topic<Message>): void {
    const oldest = topic.messages[topic.start];
    if (oldest === undefined) return;
    this.#count(topic, -costOf(oldest));
    topic.start += 1;
    if (topic.start * 2 > topic.messages.length) {
      topic.messages = topic.messages.slice(topic.start);
      topic.start = 0;
    }
  }

  #largest(): Topic<Message> {
    return [...this.#topics.values()].reduce((most, each) => (each.bytes > most.bytes ? each : most));
  }

  #count(topic: Topic<Message>, bytes: number): void {
    topic.bytes += bytes;
    this.#bytes += bytes;
  }
}

function costOf(message: Kept): number {
  return message.data.byteLength + MESSAGE_BYTES;
}

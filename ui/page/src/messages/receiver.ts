/** Receiver: the messages of the topics that the page follows, decoded once for all that look, and those of the last 60 s. */

import { signal, type ReadonlySignal } from "@preact/signals";
import type { Channel } from "../connection/protocol";
import type { ReceivedMessage, Topics } from "../connection/topics";
import { errorText } from "../store/text";
import { decoderOf, type Decoder } from "./decoding";
import { History } from "./history";
import type { Shape } from "./shapes";

/** What a message says, or a sentence that says why it cannot be read. */
export type Reading = { readonly message: unknown; readonly fault?: undefined } | { readonly fault: string };

export const KEPT_NS = 60_000_000_000n;
const MOST_BYTES = 64_000_000;
const RATE_WINDOW_MS = 3000;

/** Message of a topic; decoded when it is first read. */
export class Received {
  #reading: Reading | undefined;

  constructor(
    readonly frame: ReceivedMessage,
    private readonly decoder: Decoder | string,
  ) {}

  /** When it was published. */
  get stampNs(): bigint {
    return this.frame.stampNs;
  }

  get reading(): Reading {
    return (this.#reading ??= this.#read());
  }

  get shape(): Shape | undefined {
    return typeof this.decoder === "string" ? undefined : this.decoder.shape;
  }

  #read(): Reading {
    if (typeof this.decoder === "string") return { fault: this.decoder };
    try {
      return { message: this.decoder.decode(this.frame.data) };
    } catch (error) {
      return { fault: errorText(error) };
    }
  }
}

interface Followed {
  readonly listeners: Set<(received: Received) => void>;
  readonly end: () => void;
  readonly arrivals: number[];
  latest: Received | undefined;
}

export class Receiver {
  readonly history = new History<ReceivedMessage>(KEPT_NS, MOST_BYTES);
  readonly #topics: Pick<Topics, "listen" | "channels">;
  readonly #now: () => number;
  readonly #followed = new Map<string, Followed>();
  readonly #decoders = new WeakMap<Channel, Decoder | string>();
  #latestNs: bigint | undefined;
  readonly #isFollowing = signal(false);
  readonly #moment = signal<bigint | undefined>(undefined);

  constructor(topics: Pick<Topics, "listen" | "channels">, now: () => number = () => performance.now()) {
    this.#topics = topics;
    this.#now = now;
  }

  /** The moment at which the panels look; undefined while they follow what comes. */
  get moment(): ReadonlySignal<bigint | undefined> {
    return this.#moment;
  }

  /** Whether any topic is followed. */
  get isFollowing(): ReadonlySignal<boolean> {
    return this.#isFollowing;
  }

  /** Stamp of the message that came last; undefined while no topic is followed. */
  get latestNs(): bigint | undefined {
    return this.#latestNs;
  }

  /** Looks at a moment of the last 60 s, which stay as they are from the first such call until undefined is given. */
  lookAt(stampNs: bigint | undefined): void {
    if (stampNs === undefined) this.history.release();
    else if (this.#moment.peek() === undefined) this.history.hold();
    this.#moment.value = stampNs;
  }

  /** Calls the listener with each message of a topic until the returned function is called. */
  follow(topic: string, listener: (received: Received) => void): () => void {
    const followed = this.#followed.get(topic) ?? this.#begin(topic);
    followed.listeners.add(listener);
    return () => {
      followed.listeners.delete(listener);
      if (followed.listeners.size > 0 || this.#followed.get(topic) !== followed) return;
      this.#followed.delete(topic);
      this.history.forget(topic);
      followed.end();
      if (this.#followed.size > 0) return;
      this.#latestNs = undefined;
      this.#isFollowing.value = false;
    };
  }

  /** Returns the message that a followed topic shows: the latest, or that of the moment at which the page looks. */
  shown(topic: string): Received | undefined {
    const moment = this.#moment.peek();
    if (moment === undefined) return this.#followed.get(topic)?.latest;
    const frame = this.history.at(topic, moment);
    return frame && new Received(frame, this.#decoder(frame.channel));
  }

  /** Returns the messages of a followed topic in the last 60 s, at most `most`, oldest first. */
  past(topic: string, most: number): Received[] {
    return this.history
      .messages(topic)
      .slice(-most)
      .map((frame) => new Received(frame, this.#decoder(frame.channel)));
  }

  /** Returns how many messages of a followed topic arrive in a second; undefined before there are two. */
  rateHz(topic: string): number | undefined {
    const arrivals = this.#followed.get(topic)?.arrivals ?? [];
    const [first, last] = [arrivals[0], arrivals.at(-1)];
    if (first === undefined || last === undefined || last === first) return undefined;
    const silentMs = this.#now() - last;
    const [intervals, ms] = [arrivals.length - 1, last - first];
    return silentMs > 2 * (ms / intervals) + 1000 ? 0 : (intervals / ms) * 1000;
  }

  /** Returns the shape of a topic's messages; undefined if it is not offered, or cannot be read. */
  shapeOf(topic: string): Shape | undefined {
    const channel = this.#topics.channels.peek().get(topic);
    const decoder = channel && this.#decoder(channel);
    return typeof decoder === "object" ? decoder.shape : undefined;
  }

  #begin(topic: string): Followed {
    const followed: Followed = {
      listeners: new Set(),
      arrivals: [],
      latest: undefined,
      end: this.#topics.listen(topic, (frame) => this.#receive(followed, frame)),
    };
    this.#followed.set(topic, followed);
    this.#isFollowing.value = true;
    return followed;
  }

  #receive(followed: Followed, frame: ReceivedMessage): void {
    const received = new Received(frame, this.#decoder(frame.channel));
    const nowMs = this.#now();
    followed.latest = received;
    this.#latestNs = frame.stampNs;
    followed.arrivals.push(nowMs);
    const old = followed.arrivals.findIndex((each) => each >= nowMs - RATE_WINDOW_MS);
    if (old > 0 && followed.arrivals.length > 2) followed.arrivals.splice(0, Math.min(old, followed.arrivals.length - 2));
    this.history.add(frame.channel.topic, frame);
    for (const listener of followed.listeners) listener(received);
  }

  #decoder(channel: Channel): Decoder | string {
    const known = this.#decoders.get(channel);
    if (known !== undefined) return known;
    const found = decoderOrFault(channel);
    this.#decoders.set(channel, found);
    return found;
  }
}

function decoderOrFault(channel: Channel): Decoder | string {
  try {
    return decoderOf(channel);
  } catch (error) {
    return errorText(error);
  }
}

/** Topics: the channels that the server offers, and who listens to them; one subscription each, over reconnections. */
import { signal, type ReadonlySignal } from "@preact/signals";
import { messageFrame, type Channel, type ServerMessage } from "./protocol";
import type { Connection } from "./connection";

export interface ReceivedMessage {
  readonly channel: Channel;
  readonly stampNs: bigint;
  readonly data: DataView;
}

export type Listener = (message: ReceivedMessage) => void;

/** Topic that this page publishes. */
export interface Publication {
  /** Sends a message; false where there is no connection. */
  publish(payload: Uint8Array): boolean;
  end(): void;
}

export interface PublishedTopic {
  readonly topic: string;
  readonly encoding: "json" | "cdr";
  readonly schemaName: string;
}

export class Topics {
  readonly #connection: Pick<Connection, "send" | "sendBytes">;
  readonly #channels = signal<ReadonlyMap<string, Channel>>(new Map());
  readonly #listeners = new Map<string, Set<Listener>>();
  readonly #subscriptions = new Map<string, { readonly id: number; readonly channel: Channel }>();
  readonly #bySubscription = new Map<number, Channel>();
  readonly #publications = new Map<number, PublishedTopic>();
  #ids = 0;
  #isOpen = false;

  constructor(connection: Pick<Connection, "send" | "sendBytes">) {
    this.#connection = connection;
  }

  /** The offered channels by topic. Where a topic has several types, the first. */
  get channels(): ReadonlySignal<ReadonlyMap<string, Channel>> {
    return this.#channels;
  }

  /** Calls the listener with each message of a topic, also one that appears later, until the returned function is called. */
  listen(topic: string, listener: Listener): () => void {
    const listeners = this.#listeners.get(topic) ?? new Set();
    this.#listeners.set(topic, listeners.add(listener));
    this.#subscribe(topic);
    return () => {
      listeners.delete(listener);
      if (listeners.size > 0 || this.#listeners.get(topic) !== listeners) return;
      this.#listeners.delete(topic);
      this.#unsubscribe(topic);
    };
  }

  /** Announces a topic that this page publishes, over reconnections, until it is ended. */
  advertise(topic: PublishedTopic): Publication {
    const id = (this.#ids += 1);
    this.#publications.set(id, topic);
    if (this.#isOpen) this.#announce(id, topic);
    return {
      publish: (payload) => this.#isOpen && this.#connection.sendBytes(messageFrame(id, payload)),
      end: () => {
        if (this.#publications.delete(id) && this.#isOpen) this.#connection.send({ op: "unadvertise", channelIds: [id] });
      },
    };
  }

  opened(): void {
    this.#isOpen = true;
    for (const [id, topic] of this.#publications) this.#announce(id, topic);
  }

  ended(): void {
    this.#isOpen = false;
    this.#subscriptions.clear();
    this.#bySubscription.clear();
    this.#channels.value = new Map();
  }

  handle(message: ServerMessage): void {
    switch (message.op) {
      case "messageData":
        this.#deliver(message.subscription, message.stampNs, message.data);
        break;
      case "advertise":
        this.#add(message.channels);
        break;
      case "unadvertise":
        this.#remove(new Set(message.channelIds));
        break;
      default:
    }
  }

  #deliver(subscription: number, stampNs: bigint, data: DataView): void {
    const channel = this.#bySubscription.get(subscription);
    if (channel === undefined) return;
    for (const listener of this.#listeners.get(channel.topic) ?? []) listener({ channel, stampNs, data });
  }

  #add(added: readonly Channel[]): void {
    const channels = new Map(this.#channels.value);
    for (const channel of added) if (!channels.has(channel.topic)) channels.set(channel.topic, channel);
    this.#channels.value = channels;
    for (const topic of this.#listeners.keys()) this.#subscribe(topic);
  }

  #remove(gone: ReadonlySet<number>): void {
    this.#channels.value = new Map([...this.#channels.value].filter(([, channel]) => !gone.has(channel.id)));
    for (const [topic, { id, channel }] of [...this.#subscriptions]) {
      if (!gone.has(channel.id)) continue;
      this.#subscriptions.delete(topic);
      this.#bySubscription.delete(id);
    }
  }

  #subscribe(topic: string): void {
    const channel = this.#channels.value.get(topic);
    if (channel === undefined || this.#subscriptions.has(topic)) return;
    const id = (this.#ids += 1);
    this.#subscriptions.set(topic, { id, channel });
    this.#bySubscription.set(id, channel);
    this.#connection.send({ op: "subscribe", subscriptions: [{ id, channelId: channel.id }] });
  }

  #unsubscribe(topic: string): void {
    const found = this.#subscriptions.get(topic);
    if (found === undefined) return;
    this.#subscriptions.delete(topic);
    this.#bySubscription.delete(found.id);
    this.#connection.send({ op: "unsubscribe", subscriptionIds: [found.id] });
  }

  #announce(id: number, topic: PublishedTopic): void {
    this.#connection.send({ op: "advertise", channels: [{ id, ...topic }] });
  }
}

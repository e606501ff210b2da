/** Rates: how often each end of the graph publishes and delivers now, from counts seen one after another. */
import type { Graph, GraphTopic } from "../connection/answers";

const WINDOW_S = 3;

/** Rates in Hz, by `publishKey`, `deliverKey` and `dropKey`; missing where too little was seen. */
export type RateTable = ReadonlyMap<string, number>;

export const publishKey = (topic: string, node: string): string => `published ${topic} ${node}`;
export const deliverKey = (topic: string, node: string): string => `delivered ${topic} ${node}`;
export const dropKey = (topic: string, node: string): string => `dropped ${topic} ${node}`;

interface Seen {
  readonly elapsedS: number;
  readonly counts: ReadonlyMap<string, number>;
}

/** Computes rates by the run's own clock over the last three seconds, so that virtual time gives true rates too. */
export class Rates {
  #seen: readonly Seen[] = [];
  #table: RateTable = new Map();

  /** Takes the next state of the graph and returns the rates. */
  update(graph: Graph): RateTable {
    const lastS = this.#seen.at(-1)?.elapsedS ?? -1;
    const nowS = graph.elapsed_s ?? lastS;
    if (nowS < lastS) this.#seen = []; // another run, or one that began anew
    if (nowS === lastS) return this.#table;
    const now: Seen = { elapsedS: nowS, counts: countsOf(graph.topics) };
    const from = this.#seen.filter((seen) => now.elapsedS - seen.elapsedS <= WINDOW_S);
    // Where the run jumps by more than the window between two looks, as virtual time does, the last look counts.
    const before = from.length > 0 ? from : this.#seen.slice(-1);
    this.#seen = [...before, now];
    const [first] = before;
    this.#table = first === undefined ? new Map() : ratesBetween(first, now);
    return this.#table;
  }
}

function countsOf(topics: readonly GraphTopic[]): ReadonlyMap<string, number> {
  const counts = new Map<string, number>();
  const add = (key: string, count: number | null) => {
    if (count !== null) counts.set(key, (counts.get(key) ?? 0) + count);
  };
  for (const topic of topics) {
    for (const end of topic.publishers) add(publishKey(topic.name, end.node), end.published);
    for (const end of topic.subscriptions) {
      add(deliverKey(topic.name, end.node), end.delivered);
      add(dropKey(topic.name, end.node), end.dropped);
    }
  }
  return counts;
}

function ratesBetween(first: Seen, now: Seen): RateTable {
  const seconds = now.elapsedS - first.elapsedS;
  const rates = new Map<string, number>();
  for (const [key, count] of now.counts) {
    const before = first.counts.get(key);
    // A node that was restarted counts from 0 again: no rate until it was seen twice.
    if (before !== undefined && count >= before) rates.set(key, (count - before) / seconds);
  }
  return rates;
}

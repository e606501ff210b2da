/** The table of a run's end: what was published, delivered and dropped of each topic, as last seen. Pure. */
import type { Graph } from "../connection/answers";
import { ledgerOf } from "../panels/graph/ledger";
import { isHidden } from "../panels/graph/model";

export interface EndRow {
  readonly topic: string;
  readonly published: number;
  /** Over all subscriptions; null where none keeps a ledger. */
  readonly delivered: number | null;
  readonly dropped: number | null;
}

/** Returns a row for each topic that is not hidden; those with drops come first. */
export function endRows({ topics }: Graph): readonly EndRow[] {
  return topics
    .filter((topic) => !isHidden(topic))
    .map(({ name, published, subscriptions }) => {
      const ledger = ledgerOf(subscriptions);
      return { topic: name, published, delivered: ledger?.delivered ?? null, dropped: ledger?.dropped ?? null };
    })
    .sort((one, other) => (other.dropped ?? 0) - (one.dropped ?? 0) || one.topic.localeCompare(other.topic));
}

/** Returns a sentence for each node that had failed. */
export function failures({ nodes }: Graph): readonly string[] {
  return nodes.flatMap(({ name, failures: found }) => found.map((failure) => (failure.includes(name) ? failure : `${name}: ${failure}`)));
}

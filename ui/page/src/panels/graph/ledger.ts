/** The ledger of an edge: `published = delivered + dropped + queued`, over all its subscriptions. Pure. */
import type { TopicSubscription } from "../../connection/answers";

export interface Ledger {
  readonly published: number;
  readonly delivered: number;
  readonly dropped: number;
  readonly queued: number;
  /** Drops by reason, the most frequent first. */
  readonly reasons: readonly (readonly [string, number])[];
}

/** Returns the sums of the subscriptions that keep a ledger; null where none does, as with another program's. */
export function ledgerOf(subscriptions: readonly TopicSubscription[]): Ledger | null {
  const kept = subscriptions.filter(({ delivered }) => delivered !== null);
  if (kept.length === 0) return null;
  const sum = (count: (end: TopicSubscription) => number | null) =>
    kept.reduce((total, end) => total + (count(end) ?? 0), 0);
  const reasons = new Map<string, number>();
  for (const end of kept) {
    for (const [reason, count] of Object.entries(end.reasons)) reasons.set(reason, (reasons.get(reason) ?? 0) + count);
  }
  const [delivered, dropped, queued] = [sum((end) => end.delivered), sum((end) => end.dropped), sum((end) => end.queued)];
  return {
    published: sum((end) => end.published ?? (end.delivered ?? 0) + (end.dropped ?? 0) + (end.queued ?? 0)),
    delivered,
    dropped,
    queued,
    reasons: [...reasons].filter(([, count]) => count > 0).sort(([, one], [, other]) => other - one),
  };
}

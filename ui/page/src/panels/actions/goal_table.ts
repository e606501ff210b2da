/** Goal table: the goals of one action with their states and feedback, of this page and of others. Pure. */
import { isArray, isRecord } from "../../messages/paths";
import type { SentGoal } from "../../store/goals";

/** ROS 2's words for the states of goals, by their number. */
const STATES = ["unknown", "accepted", "executing", "canceling", "succeeded", "canceled", "aborted"] as const;
const LAST_ACTIVE = 3;
/** Most goals that are remembered; a server keeps those that ended for ten seconds. */
const MOST = 100;

interface Watched {
  readonly state: number;
  readonly acceptedNs: number;
  /** When this page saw it first. */
  readonly seenMs: number;
  readonly isGone: boolean;
}

interface Feedback {
  readonly message: unknown;
  readonly count: number;
}

export interface GoalRow {
  readonly key: string;
  /** Null of a goal that was not accepted. */
  readonly id: string | null;
  readonly state: string;
  readonly isActive: boolean;
  readonly isOwn: boolean;
  /** Null until the server has said so. */
  readonly acceptedNs: number | null;
  /** When this page sent it, or saw it first: the server's clock may be another. */
  readonly atMs: number;
  readonly feedback: Feedback | null;
  /** Null until it has ended, and of goals of others. */
  readonly result: unknown;
  /** Why it did not succeed. */
  readonly reason: string;
}

export class GoalTable {
  readonly #watched = new Map<string, Watched>();
  readonly #feedback = new Map<string, Feedback>();
  readonly #now: () => number;

  constructor(now: () => number = () => Date.now()) {
    this.#now = now;
  }

  /** Takes a message of the action's topic `status`: the goals that have not ended, and those that ended lately. */
  takeStatus(message: unknown): void {
    const list = isRecord(message) && isArray(message.status_list) ? Array.from(message.status_list) : [];
    const stated = new Map(list.flatMap((each) => statedIn(each, this.#now())));
    for (const [id, each] of this.#watched) if (!stated.has(id) && isActive(each.state)) this.#watched.set(id, { ...each, isGone: true });
    for (const [id, each] of stated) this.#watched.set(id, { ...each, seenMs: this.#watched.get(id)?.seenMs ?? each.seenMs });
    forgetOldest(this.#watched);
  }

  /** Takes a message of the action's topic `feedback`. */
  takeFeedback(message: unknown): void {
    const id = isRecord(message) ? idOf(message.goal_id) : null;
    if (id === null || !isRecord(message)) return;
    const count = (this.#feedback.get(id)?.count ?? 0) + 1;
    this.#feedback.set(id, { message: message.feedback, count });
    forgetOldest(this.#feedback);
  }

  /** Returns the goals, newest first; without a server none goes on. */
  rows(sent: readonly SentGoal[], hasServer: boolean): readonly GoalRow[] {
    const own = sent.map((goal) => this.#ownRow(goal, hasServer));
    const ids = new Set(sent.map(({ id }) => id));
    const others = [...this.#watched].filter(([id]) => !ids.has(id)).map(([id, each]) => this.#row(id, each, hasServer));
    return [...own, ...others].sort(newestFirst);
  }

  #row(id: string, { state, acceptedNs, seenMs, isGone }: Watched, hasServer: boolean): GoalRow {
    const goesOn = isActive(state) && !isGone && hasServer;
    const word = isActive(state) && !goesOn ? "gone" : (STATES[state] ?? "unknown");
    const feedback = this.#feedback.get(id) ?? null;
    return { key: id, id, state: word, isActive: goesOn, isOwn: false, acceptedNs, atMs: seenMs, feedback, result: null, reason: "" };
  }

  #ownRow(goal: SentGoal, hasServer: boolean): GoalRow {
    const { id, phase, result, reason } = goal;
    const own = { key: `sent ${goal.key}`, id, isOwn: true, atMs: goal.sentMs, result, reason };
    const watched = id === null ? undefined : this.#watched.get(id);
    if (id !== null && watched !== undefined && phase !== "ended") return { ...this.#row(id, watched, hasServer), ...own };
    const acceptedNs = watched?.acceptedNs ?? null;
    const feedback = id === null ? null : (this.#feedback.get(id) ?? null);
    return { ...own, state: ownState(goal), isActive: phase === "going" && hasServer, acceptedNs, feedback };
  }
}

function ownState({ phase, state, id }: SentGoal): string {
  if (phase === "sending") return "sending";
  if (phase === "going") return "accepted";
  if (phase === "failed") return id === null ? "not accepted" : "gone";
  return STATES[state ?? 0] ?? "unknown";
}

function isActive(state: number): boolean {
  return state > 0 && state <= LAST_ACTIVE;
}

function newestFirst(one: GoalRow, other: GoalRow): number {
  return other.atMs - one.atMs || (other.acceptedNs ?? 0) - (one.acceptedNs ?? 0);
}

function statedIn(each: unknown, seenMs: number): [string, Watched][] {
  if (!isRecord(each) || !isRecord(each.goal_info)) return [];
  const { goal_id: goalId, stamp } = each.goal_info;
  const id = idOf(goalId);
  if (id === null || typeof each.status !== "number" || !isRecord(stamp)) return [];
  return [[id, { state: each.status, acceptedNs: Number(stamp.sec) * 1e9 + Number(stamp.nanosec), seenMs, isGone: false }]];
}

/** Returns an identifier as text, `8-4-4-4-12` hexadecimal digits; null where it is none. */
function idOf(goalId: unknown): string | null {
  if (!isRecord(goalId) || !isArray(goalId.uuid) || goalId.uuid.length !== 16) return null;
  const digits = Array.from(goalId.uuid, (byte) => Number(byte).toString(16).padStart(2, "0")).join("");
  return digits.replace(/^(.{8})(.{4})(.{4})(.{4})(.{12})$/, "$1-$2-$3-$4-$5");
}

function forgetOldest(kept: Map<string, unknown>): void {
  for (const key of [...kept.keys()].slice(0, Math.max(0, kept.size - MOST))) kept.delete(key);
}

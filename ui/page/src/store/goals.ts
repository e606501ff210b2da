/** Goals: those that this page has sent to actions, each with what came of it; kept while the panels change. */
import { signal, type ReadonlySignal } from "@preact/signals";
import type { ActionTypes } from "../connection/answers";
import type { Questions } from "../connection/questions";
import { base64Of, bytesOf } from "../messages/base64";
import { decoderOf } from "../messages/decoding";
import { encoderOf } from "../messages/encoding";
import type { Shape } from "../messages/shapes";
import { errorText } from "./text";

/** What a goal and a result of one action are, ready to be written and read. */
export interface GoalCodec {
  readonly shape: Shape;
  encode(goal: unknown): string;
  decode(result: string): unknown;
}

/** Returns the codec of an action; throws an Error that says why there is none. */
export function goalCodec(action: string, { goal, result }: ActionTypes): GoalCodec {
  const encoder = encoderOf(goal);
  const decoder = decoderOf({ id: 0, topic: `the result of ${action}`, ...result });
  return {
    shape: encoder.shape,
    encode: (message) => base64Of(encoder.encode(message)),
    decode: (text) => decoder.decode(bytesOf(text)),
  };
}

export interface SentGoal {
  readonly key: number;
  readonly action: string;
  readonly sentMs: number;
  /** Null until its server has accepted it. */
  readonly id: string | null;
  readonly phase: "sending" | "going" | "ended" | "failed";
  /** ROS 2's number of its end; null until then, and where that is not known. */
  readonly state: number | null;
  readonly result: unknown;
  /** Why it did not succeed. */
  readonly reason: string;
}

/** Most goals that are kept; the server lets far fewer be under way. */
const MOST = 50;
/** Time beyond the goal's own limit after which no end comes any more. */
const GRACE_S = 15;

export class Goals {
  readonly #sent = signal<readonly SentGoal[]>([]);
  readonly #questions: Pick<Questions, "ask">;
  #keys = 0;

  constructor(questions: Pick<Questions, "ask">) {
    this.#questions = questions;
  }

  /** The goals that were sent, oldest first. */
  get sent(): ReadonlySignal<readonly SentGoal[]> {
    return this.#sent;
  }

  /** Sends a goal, which is canceled where it has not ended within the limit. */
  async send(action: string, codec: GoalCodec, goal: unknown, limitS: number | null): Promise<void> {
    const key = (this.#keys += 1);
    const sent: SentGoal = { key, action, sentMs: Date.now(), id: null, phase: "sending", state: null, result: null, reason: "" };
    this.#sent.value = [...this.#sent.value, sent].slice(-MOST);
    const onPart = (part: unknown): void => this.#change(key, { id: (part as { readonly id: string }).id, phase: "going" });
    try {
      const question = { action, goal: codec.encode(goal), limit_s: limitS };
      const end = await this.#questions.ask("send_goal", question, limitS === null ? null : (limitS + GRACE_S) * 1000, onPart);
      this.#change(key, { phase: "ended", state: end.state, result: codec.decode(end.result), reason: end.reason });
    } catch (error) {
      this.#change(key, { phase: "failed", reason: errorText(error) });
    }
  }

  #change(key: number, change: Partial<SentGoal>): void {
    this.#sent.value = this.#sent.value.map((each) => (each.key === key ? { ...each, ...change } : each));
  }
}

/** A signal that follows one of busflow's questions exactly as long as something reads it. */
import { signal, type ReadonlySignal } from "@preact/signals";
import type { Question, QuestionTable } from "../connection/answers";
import type { Questions } from "../connection/questions";

/** Returns the next state after an answer; the first after each beginning has everything. */
export type Reduce<Q extends Question, S> = (state: S, answer: QuestionTable[Q]["answer"], isFirst: boolean) => S;

export function followed<Q extends Question, S>(
  questions: Questions,
  question: Q,
  initial: S,
  reduce: Reduce<Q, S>,
): ReadonlySignal<S> {
  let end: (() => void) | null = null;
  const state = signal(initial, {
    watched: () => {
      end = questions.follow(question, (answer, isFirst) => {
        state.value = reduce(state.peek(), answer, isFirst);
      });
    },
    unwatched: () => {
      end?.();
      end = null;
    },
  });
  return state;
}

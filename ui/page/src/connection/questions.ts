/** Questions: busflow's own questions to the run, each with a time limit, and those that are followed. */
import type { Question, QuestionTable } from "./answers";
import { limits } from "../limits";
import type { Operation, ServerMessage } from "./protocol";

/** The run's refusal of a question, in its words. */
export class QuestionError extends Error {}

interface Pending {
  readonly resolve: (answer: unknown) => void;
  readonly reject: (error: QuestionError) => void;
  readonly timer: ReturnType<typeof setTimeout> | undefined;
  readonly onPart: ((part: unknown) => void) | undefined;
}

/** Takes an answer, and whether it is the first since the question was begun: that one has everything. */
type Follower = (answer: unknown, isFirst: boolean) => void;
type Send = (operation: Operation) => void;

export class Questions {
  readonly #send: Send;
  readonly #pending = new Map<number, Pending>();
  readonly #followers = new Map<string, Set<Follower>>();
  readonly #begun = new Set<string>();
  #ids = 0;
  #isOpen = false;

  constructor(send: Send) {
    this.#send = send;
  }

  /**
   * Asks the run; parts of an answer that has some come before it.
   *
   * Rejects with QuestionError where the run refuses, is not connected, or does not answer in time; null is no limit.
   */
  ask<Q extends Question>(
    question: Q,
    args: QuestionTable[Q]["arguments"],
    limitMs: number | null = limits.answer,
    onPart?: (part: unknown) => void,
  ): Promise<QuestionTable[Q]["answer"]> {
    if (!this.#isOpen) return Promise.reject(new QuestionError("There is no connection to the run."));
    const id = (this.#ids += 1);
    return new Promise<QuestionTable[Q]["answer"]>((resolve, reject) => {
      const giveUp = (ms: number): void => {
        this.#pending.delete(id);
        reject(new QuestionError(`No answer within ${ms / 1000} s.`));
      };
      const timer = limitMs === null ? undefined : setTimeout(giveUp, limitMs, limitMs);
      this.#pending.set(id, { resolve: resolve as (answer: unknown) => void, reject, timer, onPart });
      this.#send({ op: "busflow/ask", id, question, arguments: args });
    });
  }

  /**
   * Calls the listener with each new answer to a question, over reconnections, until the returned function is called.
   *
   * The first answer after each beginning has everything; the others of some questions only what is new.
   */
  follow<Q extends Question>(
    question: Q,
    listener: (answer: QuestionTable[Q]["answer"], isFirst: boolean) => void,
  ): () => void {
    const each = listener as Follower;
    const followers = this.#followers.get(question) ?? new Set();
    this.#followers.set(question, followers.add(each));
    if (this.#isOpen) {
      // Another beginning sends everything again, which the new follower needs.
      if (followers.size > 1) this.#send({ op: "busflow/follow", question, on: false });
      this.#begin(question);
    }
    return () => {
      followers.delete(each);
      if (followers.size > 0 || this.#followers.get(question) !== followers) return;
      this.#followers.delete(question);
      if (this.#isOpen) this.#send({ op: "busflow/follow", question, on: false });
    };
  }

  opened(): void {
    this.#isOpen = true;
    for (const question of this.#followers.keys()) this.#begin(question);
  }

  ended(): void {
    this.#isOpen = false;
    this.#begun.clear();
    for (const each of this.#pending.values()) {
      clearTimeout(each.timer);
      each.reject(new QuestionError("The connection ended before the answer came."));
    }
    this.#pending.clear();
  }

  handle(message: ServerMessage): void {
    if (message.op === "busflow/update") {
      const isFirst = this.#begun.delete(message.question);
      for (const listener of this.#followers.get(message.question) ?? []) listener(message.answer, isFirst);
    } else if (message.op === "busflow/part") {
      this.#pending.get(message.id)?.onPart?.(message.part);
    } else if (message.op === "busflow/answer") {
      const found = this.#pending.get(message.id);
      if (found === undefined) return;
      this.#pending.delete(message.id);
      clearTimeout(found.timer);
      if (message.error === undefined) found.resolve(message.answer);
      else found.reject(new QuestionError(message.error));
    }
  }

  #begin(question: string): void {
    this.#begun.add(question);
    this.#send({ op: "busflow/follow", question, on: true });
  }
}

/** The state of the run in one word, with its tone. Pure. */
import type { EndedRun, Run } from "../connection/answers";
import type { ConnectionState } from "../connection/connection";
import type { Source } from "../store/session";
import { durationText } from "../store/text";

export interface RunState {
  readonly tone: "good" | "warn" | "bad" | "quiet";
  readonly word: string;
}

/** Returns the state of the run as far as this page knows it. */
export function runState(connection: ConnectionState, run: Run | null, source: Source): RunState {
  if (connection.phase === "refused") return { tone: "bad", word: "refused" };
  if (run?.ended !== undefined) return { tone: isBadEnd(run.ended) ? "bad" : "quiet", word: run.ended.was_killed === true ? "killed" : "ended" };
  if (connection.phase === "connecting") return { tone: "quiet", word: "connecting" };
  if (connection.phase === "waiting") return { tone: "bad", word: "not connected" };
  if (source === "recording") return { tone: "quiet", word: "recording" };
  return run?.silent_s === undefined ? { tone: "good", word: "running" } : { tone: "bad", word: "no answer" };
}

/** Whether a run was killed, or logged errors just before its end. */
export function isBadEnd({ was_killed: wasKilled, errors }: EndedRun): boolean {
  return wasKilled === true || (errors ?? []).length > 0;
}

/** Returns how a run ended, as far as it is known. */
export function endSentence(name: string, { was_killed: wasKilled, elapsed_s: elapsedS, reason }: EndedRun): string {
  if (reason !== undefined) return `${reason}.`;
  const after = typeof elapsedS === "number" ? ` after ${durationText(elapsedS)}` : "";
  return wasKilled === true ? `The run ${name} has ended${after}: its process was killed.` : `The run ${name} has ended${after}.`;
}

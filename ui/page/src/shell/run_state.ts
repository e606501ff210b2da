/** The state of the run in one word, with its tone. Pure. */
import type { Run } from "../connection/answers";
import type { ConnectionState } from "../connection/connection";
import type { Source } from "../store/session";

export interface RunState {
  readonly tone: "good" | "warn" | "bad" | "quiet";
  readonly word: string;
}

/** Returns the state of the run as far as this page knows it. */
export function runState(connection: ConnectionState, run: Run | null, source: Source): RunState {
  if (connection.phase === "refused") return { tone: "bad", word: "refused" };
  if (run?.ended !== undefined) return { tone: (run.ended.exit_code ?? 0) === 0 ? "quiet" : "bad", word: "ended" };
  if (connection.phase === "connecting") return { tone: "quiet", word: "connecting" };
  if (connection.phase === "waiting") return { tone: "bad", word: "not connected" };
  if (source === "recording") return { tone: "quiet", word: "recording" };
  return run?.silent_s === undefined ? { tone: "good", word: "running" } : { tone: "bad", word: "no answer" };
}

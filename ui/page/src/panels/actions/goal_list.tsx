/** Goal list: the goals of one action, of this page and of others, with feedback as it comes, result and cancel. */
import { useSignal } from "@preact/signals";
import { useEffect, useMemo } from "preact/hooks";
import { Answer } from "../../forms/answer";
import type { Received } from "../../messages/receiver";
import { useFrames } from "../../plots/hooks";
import { observationOf } from "../../plots/observation";
import type { Session } from "../../store/session";
import { clockText, counted, errorText } from "../../store/text";
import { GoalTable, type GoalRow } from "./goal_table";

export const STATUS = "/_action/status";
export const FEEDBACK = "/_action/feedback";
const SHORT_ID = 8;
const TONES: Readonly<Record<string, string>> = { aborted: "bad", "not accepted": "bad", gone: "bad", canceling: "warn", canceled: "warn" };

interface ListProps {
  readonly session: Session;
  readonly action: string;
  readonly hasServer: boolean;
}

export function GoalList({ session, action, hasServer }: ListProps) {
  const table = useGoals(session, action);
  const sent = session.goals.sent.value.filter((goal) => goal.action === action);
  const rows = table.rows(sent, hasServer);
  const active = rows.filter(({ isActive }) => isActive);
  const [newest] = rows.filter(({ isOwn }) => isOwn);
  return (
    <section class="goals" aria-label="Goals">
      <header class="goals-head">
        <h3>Goals</h3>
        <span class="visually-hidden" role="status">
          {newest === undefined ? "" : `The last goal of this page: ${newest.state} ${newest.reason}`}
        </span>
        {active.length > 1 && session.maySteer.value && session.answersQuestions.value && (
          <CancelButton session={session} action={action} id={null} />
        )}
      </header>
      {rows.length === 0 && <p class="quiet">None lately</p>}
      <ul>
        {rows.map((row) => (
          <Goal key={row.key} session={session} action={action} row={row} />
        ))}
      </ul>
    </section>
  );
}

/** Follows the goals of an action while the component stands. */
function useGoals(session: Session, action: string): GoalTable {
  const observation = observationOf(session);
  const table = useMemo(() => new GoalTable(), [session, action]);
  useEffect(() => {
    const { receiver, frames } = observation;
    const follow = (topic: string, take: (message: unknown) => void) => {
      const read = ({ reading }: Received): void => {
        if (reading.fault === undefined) take(reading.message);
        frames.request();
      };
      const end = receiver.follow(topic, read);
      const last = receiver.shown(topic); // where another panel follows it already
      if (last !== undefined) read(last);
      return end;
    };
    const ends = [
      follow(action + STATUS, (message) => table.takeStatus(message)),
      follow(action + FEEDBACK, (message) => table.takeFeedback(message)),
    ];
    return () => {
      for (const end of ends) end();
    };
  }, [observation, action, table]);
  useFrames(observation);
  return table;
}

interface GoalProps {
  readonly session: Session;
  readonly action: string;
  readonly row: GoalRow;
}

function Goal({ session, action, row }: GoalProps) {
  const { id, state, isActive, isOwn, acceptedNs, feedback, result, reason } = row;
  return (
    <li class="goal" data-goal={id ?? ""}>
      <div class="goal-head">
        <span class={`badge ${TONES[state] ?? ""}`}>{state}</span>
        {id !== null && (
          <span class="mono small" title={id}>
            {id.slice(0, SHORT_ID)}
          </span>
        )}
        <span class="quiet small">
          {isOwn ? "sent here" : "of another client"}
          {acceptedNs !== null && `, accepted ${clockText(acceptedNs)}`}
        </span>
        {id !== null && isActive && session.maySteer.value && session.answersQuestions.value && (
          <CancelButton session={session} action={action} id={id} />
        )}
      </div>
      {reason !== "" && <p class={TONES[state] ?? ""}>{reason}</p>}
      {feedback !== null && (
        <div>
          <p class="quiet small">Feedback, the last of {counted(feedback.count, "message")}</p>
          <Answer message={feedback.message} empty="(feedback without fields)" />
        </div>
      )}
      {result !== null && (
        <div>
          <p class="quiet small">Result</p>
          <Answer message={result} empty="(a result without fields)" />
        </div>
      )}
    </li>
  );
}

interface CancelProps {
  readonly session: Session;
  readonly action: string;
  /** Null cancels all goals. */
  readonly id: string | null;
}

function CancelButton({ session, action, id }: CancelProps) {
  const fault = useSignal("");
  const cancel = () => {
    session.questions.ask("cancel_goal", { action, ...(id === null ? {} : { id }) }).then(
      () => (fault.value = ""),
      (error: unknown) => (fault.value = errorText(error)),
    );
  };
  return (
    <>
      <span class="grow" />
      <span class="bad small" role="alert">
        {fault.value}
      </span>
      <button type="button" class="button" onClick={cancel}>
        {id === null ? "Cancel all" : "Cancel"}
      </button>
    </>
  );
}

/** Goal form: made from the type of the action's goals; sends one, with a time limit. */
import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { RequestForm } from "../../forms/request_form";
import { TimeLimit } from "../../forms/time_limit";
import { goalCodec, type GoalCodec } from "../../store/goals";
import type { Session } from "../../store/session";
import { errorText } from "../../store/text";

const MOST_LIMIT_S = 86_400;

interface FormProps {
  readonly session: Session;
  readonly action: string;
}

export function GoalForm({ session, action }: FormProps) {
  const codec = useCodec(session, action);
  const limit = useSignal<number | null>(null);
  if (codec === null) return null;
  if (typeof codec === "string") return <p class="bad">{codec}</p>;
  return (
    <div class="call">
      <RequestForm
        shape={codec.shape}
        empty="Its goal has no fields."
        onRequest={(goal) => void session.goals.send(action, codec, goal, limit.value)}
      >
        <button type="submit" class="button primary">
          Send goal
        </button>
        <TimeLimit seconds={limit.value} most={MOST_LIMIT_S} usual={null} onSeconds={(seconds) => (limit.value = seconds)} />
      </RequestForm>
    </div>
  );
}

/** Asks what the action's goals are; returns null until that is known, or a sentence why it is not. */
function useCodec(session: Session, action: string): GoalCodec | string | null {
  const codec = useSignal<GoalCodec | string | null>(null);
  useEffect(() => {
    let isWanted = true;
    void session.questions
      .ask("action", { action })
      .then((types) => goalCodec(action, types))
      .catch(errorText)
      .then((found) => {
        if (isWanted) codec.value = found;
      });
    return () => {
      isWanted = false;
    };
  }, [session, action]);
  return codec.value;
}

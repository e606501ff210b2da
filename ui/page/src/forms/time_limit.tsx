/** Time limit of a call or a goal, in seconds. */
import "./forms.css";

const LEAST_S = 0.1;

interface LimitProps {
  /** Null where there is none. */
  readonly seconds: number | null;
  readonly most: number;
  /** What an empty field stands for; null is no limit. */
  readonly usual: number | null;
  readonly onSeconds: (seconds: number | null) => void;
}

export function TimeLimit({ seconds, most, usual, onSeconds }: LimitProps) {
  return (
    <label class="check quiet">
      time limit
      <input
        class="field limit"
        type="number"
        min={LEAST_S}
        max={most}
        step="any"
        placeholder="none"
        value={seconds ?? ""}
        onChange={(event) => {
          const typed = event.currentTarget.valueAsNumber;
          onSeconds(typed > 0 ? Math.min(most, Math.max(LEAST_S, typed)) : usual);
        }}
      />
      s
    </label>
  );
}

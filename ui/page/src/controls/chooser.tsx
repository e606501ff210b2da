/** Chooser: a list of names with their types, and beside it what is chosen. */
import type { ComponentChildren } from "preact";
import "./chooser.css";

export interface Choice {
  readonly name: string;
  readonly type: string;
}

interface ChooserProps {
  readonly label: string;
  readonly choices: readonly Choice[];
  readonly chosen: string | undefined;
  readonly onChoose: (name: string) => void;
  /** What is shown where there is nothing to choose. */
  readonly empty: string;
  /** What is chosen, or what is shown while nothing is. */
  readonly children: ComponentChildren;
}

export function Chooser({ label, choices, chosen, onChoose, empty, children }: ChooserProps) {
  return (
    <div class="chooser">
      <ul class="chooser-list" aria-label={label}>
        {choices.map(({ name, type }) => (
          <li key={name}>
            <button type="button" class="row" aria-current={name === chosen} onClick={() => onChoose(name)}>
              <span class="mono">{name}</span>
              <span class="quiet small">{type}</span>
            </button>
          </li>
        ))}
        {choices.length === 0 && <li class="empty">{empty}</li>}
      </ul>
      <div class="chooser-chosen">{children}</div>
    </div>
  );
}

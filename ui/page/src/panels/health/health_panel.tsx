/** Health panel: what `busflow doctor` finds wrong in the run, each with its fix. */
import type { Finding } from "../../connection/answers";
import type { PanelProps } from "../panel";
import "./health.css";

const RANKS: Readonly<Record<string, number>> = { error: 0, warning: 1 };

/** Begins a fix that only lists the names there are, as the command prints it. */
const KNOWN = "known: ";

export function HealthPanel({ session }: PanelProps) {
  const findings = session.findings.value;
  if (findings === null) {
    return (
      <p class="empty" aria-busy="true">
        Examining the run
      </p>
    );
  }
  if (findings.length === 0) {
    return (
      <div class="empty">
        <strong class="good">Nothing is wrong</strong>
        <span>busflow doctor finds no mistake, no loss and no lateness in this run.</span>
      </div>
    );
  }
  const sorted = [...findings].sort((one, other) => (RANKS[one.severity] ?? 2) - (RANKS[other.severity] ?? 2));
  return (
    <ul class="scroll findings" aria-label="Findings">
      {sorted.map((finding) => (
        <FindingRow key={`${finding.code} ${finding.message}`} finding={finding} />
      ))}
    </ul>
  );
}

function FindingRow({ finding }: { readonly finding: Finding }) {
  const { severity, message, fix, file, line } = finding;
  return (
    <li class="finding">
      <span class={`badge ${severity === "error" ? "bad" : "warn"}`}>{severity}</span>
      <div>
        <p>{message}</p>
        {fix !== null && (
          <p class="fix">
            {!fix.startsWith(KNOWN) && <span class="quiet">Fix: </span>}
            {fix}
          </p>
        )}
        {file !== null && (
          <p class="quiet small mono">
            {file}
            {line !== null && `:${line}`}
          </p>
        )}
      </div>
    </li>
  );
}

/** Top bar: the run's name, state and age, what this browser missed, and the settings of the page. */
import { useSignal, type Signal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import type { Run } from "../connection/answers";
import { offeredPanels } from "../panels/registry";
import type { Session } from "../store/session";
import { durationText } from "../store/text";
import { Icon } from "../controls/icons";
import { SaveEdit } from "../controls/save_edit";
import { addPanel, type Layout } from "./layout";
import { runState } from "./run_state";
import { nextTheme, theme } from "./theme";

interface TopBarProps {
  readonly session: Session;
  readonly layout: Signal<Layout>;
  readonly onAbout: () => void;
}

export function TopBar({ session, layout, onAbout }: TopBarProps) {
  const metadata = session.server.value?.metadata;
  const run = session.run.value;
  const name = run?.name ?? metadata?.run ?? session.server.value?.name ?? "";
  const { tone, word } = runState(session.state.value, run, session.source.value);
  return (
    <header class="top-bar">
      <strong class="brand">busflow</strong>
      {name !== "" && <h1 class="run-name">{name}</h1>}
      <span class={`run-state ${tone}`} role="status">
        <span class="dot" aria-hidden="true" />
        {word}
      </span>
      <Age run={run} />
      {metadata?.access === "read-only" && <span class="badge">read-only</span>}
      <Missed session={session} />
      <span class="grow" />
      <AddPanel session={session} layout={layout} />
      {session.source.value === "run" && session.maySteer.value && session.answersQuestions.value && (
        <SaveEdit
          label="Save layout…"
          ask={(isDryRun) => session.questions.ask("save_layout", { layout: layout.value, dry_run: isDryRun })}
        />
      )}
      <button
        type="button"
        class="button plain icon"
        title={`Theme: ${theme.value}`}
        aria-label={`Theme: ${theme.value}. Change it`}
        onClick={nextTheme}
      >
        <Icon name={theme.value} />
      </button>
      <button type="button" class="button plain icon" title="About" aria-label="About this page" onClick={onAbout}>
        <Icon name="about" />
      </button>
    </header>
  );
}

/** How long the run has been there, by this browser's clock. */
function Age({ run }: { readonly run: Run | null }) {
  const now = useSignal(Date.now());
  useEffect(() => {
    const timer = setInterval(() => (now.value = Date.now()), 1000);
    return () => clearInterval(timer);
  }, [now]);
  if (run?.since_ns === undefined || run.ended !== undefined) return null;
  return (
    <span class="quiet run-age">
      for {durationText((now.value - run.since_ns / 1e6) / 1000)}
      {run.clock !== "system" && `, on ${run.clock ?? "another"} time`}
    </span>
  );
}

/** What this browser did not get because it reads too slowly. */
function Missed({ session }: { readonly session: Session }) {
  const status = session.statuses.value.find(({ key }) => key === "drops");
  if (status === undefined) return null;
  return (
    <span class="badge warn missed" title={`${status.message} (by this browser)`}>
      {status.message}
    </span>
  );
}

function AddPanel({ session, layout }: Pick<TopBarProps, "session" | "layout">) {
  return (
    <select
      class="add-panel"
      aria-label="Add a panel beside"
      value=""
      onChange={(event) => {
        const kind = event.currentTarget.value;
        event.currentTarget.value = "";
        if (kind !== "") layout.value = addPanel(layout.value, kind);
      }}
    >
      <option value="">Add panel</option>
      {offeredPanels(session).map(({ kind, title }) => (
        <option key={kind} value={kind}>
          {title}
        </option>
      ))}
    </select>
  );
}

/** Banners: what must be seen above the panels: the end of the run, a lost connection, the server's warnings. */
import type { EndedRun, Run } from "../connection/answers";
import type { Session, Status } from "../store/session";
import { durationText, secondsText } from "../store/text";
import { Icon } from "../controls/icons";

/** Statuses that are shown otherwise: in the top bar, and as the state of the run. */
const OWN_PLACE: ReadonlySet<string> = new Set(["drops", "run"]);

export function Banners({ session }: { readonly session: Session }) {
  const state = session.state.value;
  const run = session.run.value;
  const ended = state.phase === "refused" ? undefined : run?.ended;
  const statuses = session.statuses.value.filter(({ key, level }) => !OWN_PLACE.has(key) && level > 0);
  return (
    <div class="banners" aria-live="polite">
      {state.phase === "refused" && (
        <Banner tone="bad" title="This address opens nothing (any more).">
          {state.reason || "Its token is wrong."} Open the address that <code>busflow ui</code> printed when it started.
        </Banner>
      )}
      {state.phase === "waiting" && ended === undefined && (
        <Banner tone="bad" title={state.reason}>
          What you see is the last that was known. The page connects again by itself.
        </Banner>
      )}
      {run !== null && ended !== undefined && <EndOfRun run={run} ended={ended} />}
      {run?.silent_s !== undefined && state.phase === "open" && (
        <Banner tone="bad" title={`The run does not answer since ${secondsText(run.silent_s)}.`}>
          A handler may block its event loop. The page goes on as soon as it answers.
        </Banner>
      )}
      {statuses.map((status) => (
        <StatusBanner key={status.key} status={status} onClose={() => session.dismiss(status.key)} />
      ))}
    </div>
  );
}

interface BannerProps {
  readonly tone: "bad" | "warn" | "quiet";
  readonly title: string;
  readonly children?: preact.ComponentChildren;
}

function Banner({ tone, title, children }: BannerProps) {
  return (
    <div class={`banner ${tone}`}>
      <strong>{title}</strong> <span>{children}</span>
    </div>
  );
}

function EndOfRun({ run, ended }: { readonly run: Run; readonly ended: EndedRun }) {
  const code = ended.exit_code ?? null;
  const report = ended.report ?? "";
  const isBad = code !== null && code !== 0;
  const after = typeof ended.elapsed_s === "number" ? ` after ${durationText(ended.elapsed_s)}` : "";
  const how = code === null ? "" : isBad ? ` with exit code ${code}` : " well";
  return (
    <div class={`banner ${isBad ? "bad" : "quiet"}`}>
      <strong>
        The run {run.name} has ended{how}
        {after}.
      </strong>{" "}
      <span>The page shows the next run of this name as soon as there is one.</span>
      {report !== "" && (
        <details open>
          <summary>Its report</summary>
          <pre class="mono report" tabIndex={0}>
            {report}
          </pre>
        </details>
      )}
    </div>
  );
}

function StatusBanner({ status, onClose }: { readonly status: Status; readonly onClose: () => void }) {
  return (
    <div class={`banner row ${status.level === 2 ? "bad" : "warn"}`}>
      <span>
        <strong>{status.level === 2 ? "Error" : "Warning"}:</strong> {status.message}
      </span>
      <button type="button" class="button plain icon" aria-label="Dismiss" onClick={onClose}>
        <Icon name="close" />
      </button>
    </div>
  );
}

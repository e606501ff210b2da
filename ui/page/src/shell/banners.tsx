/** Banners: what must be seen above the panels: the end of the run, a lost connection, the server's warnings. */
import type { EndedRun, Graph, Run } from "../connection/answers";
import type { Session, Status } from "../store/session";
import { countText, durationText, secondsText } from "../store/text";
import { Icon } from "../controls/icons";
import { endRows, failures } from "./end_table";

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
      {run !== null && ended !== undefined && <EndOfRun run={run} ended={ended} graph={session.graph.value?.graph ?? null} />}
      {run?.silent_s !== undefined && state.phase === "open" && (
        <Banner tone="bad" title={`The run has not answered for ${secondsText(run.silent_s)}.`}>
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

interface EndProps {
  readonly run: Run;
  readonly ended: EndedRun;
  /** The graph as it was last seen. */
  readonly graph: Graph | null;
}

function EndOfRun({ run, ended, graph }: EndProps) {
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
      {report === "" ? graph !== null && <LastSeen graph={graph} /> : <Report text={report} />}
    </div>
  );
}

function Report({ text }: { readonly text: string }) {
  return (
    <details open>
      <summary>Its report</summary>
      <pre class="mono report" tabIndex={0}>
        {text}
      </pre>
    </details>
  );
}

/** What each topic had counted when the run was last seen, and which nodes had failed. */
function LastSeen({ graph }: { readonly graph: Graph }) {
  const rows = endRows(graph);
  if (rows.length === 0) return null;
  return (
    <details open>
      <summary>As last seen</summary>
      {failures(graph).map((failure) => (
        <p key={failure} class="bad">
          {failure}
        </p>
      ))}
      <div class="report" tabIndex={0} role="region" aria-label="Topics as last seen">
        <table class="table">
          <thead>
            <tr>
              <th scope="col">topic</th>
              <th scope="col" class="number">
                published
              </th>
              <th scope="col" class="number">
                delivered
              </th>
              <th scope="col" class="number">
                dropped
              </th>
            </tr>
          </thead>
          <tbody>
            {rows.map(({ topic, published, delivered, dropped }) => (
              <tr key={topic}>
                <td class="mono">{topic}</td>
                <td class="number">{countText(published)}</td>
                <td class="number">{delivered === null ? "–" : countText(delivered)}</td>
                <td class={`number ${(dropped ?? 0) > 0 ? "bad" : ""}`}>{dropped === null ? "–" : countText(dropped)}</td>
              </tr>
            ))}
          </tbody>
        </table>
      </div>
    </details>
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

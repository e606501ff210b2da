/** Banners: what must be seen above the panels: the end of the run, a lost connection, the server's warnings. */
import type { EndedRun, Graph, Run } from "../connection/answers";
import type { Session, Status } from "../store/session";
import { countText, secondsText } from "../store/text";
import { Icon } from "../controls/icons";
import { endRows, failures } from "./end_table";
import { endSentence, isBadEnd } from "./run_state";

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
  const errors = ended.errors ?? [];
  return (
    <div class={`banner ${isBadEnd(ended) ? "bad" : "quiet"}`}>
      <strong>{endSentence(run.name, ended)}</strong>{" "}
      <span>
        {ended.reason === undefined ? "The page shows the next run of this name as soon as there is one." : "The page goes on once it answers."}
      </span>
      {errors.length > 0 && (
        <ul class="last-errors" aria-label="The last errors of its log">
          {errors.map((error, index) => (
            <li key={index} class="bad mono">
              {error}
            </li>
          ))}
        </ul>
      )}
      {graph !== null && <LastSeen graph={graph} seenS={ended.seen_s} />}
    </div>
  );
}

interface LastSeenProps {
  readonly graph: Graph;
  readonly seenS: number | undefined;
}

/** What each topic had counted when the run was last seen, and which nodes had failed. */
function LastSeen({ graph, seenS }: LastSeenProps) {
  const rows = endRows(graph);
  if (rows.length === 0) return null;
  return (
    <details open>
      <summary>As last seen{seenS !== undefined && `, ${secondsText(seenS)} before its end`}</summary>
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

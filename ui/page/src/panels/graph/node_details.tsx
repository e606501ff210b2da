/** Node details: its state, source, timers, ends and parameters, and the buttons that steer it. */
import { useSignal } from "@preact/signals";
import { Fragment, type ComponentChild } from "preact";
import type { GraphNode, GraphService, Timer } from "../../connection/answers";
import type { Session } from "../../store/session";
import { countText, errorText, rateText, secondsText } from "../../store/text";
import { LEVELS } from "../log/filter";
import { ParameterForm } from "../parameters/parameter_form";
import { Heading, Link, Section, type DetailsProps } from "./details_parts";
import { edgeId, isHidden, serviceKind, toneOf, vertexId } from "./model";
import { Sign } from "./sign";

export function NodeDetails({ session, state, node, onSelect }: DetailsProps & { readonly node: GraphNode }) {
  const hidden = new Set(state.graph.topics.filter(isHidden).map(({ name }) => name));
  const services = state.graph.services.filter((service) => !service.hidden);
  const own = services.filter(({ servers }) => servers.some((end) => end.node === node.name));
  return (
    <>
      <Heading kind="Node">{node.name}</Heading>
      <p class="node-state">
        <Sign tone={toneOf(node.state)} /> {node.state}
        {node.restarts > 0 && <span class="badge warn">restarted {node.restarts}×</span>}
      </p>
      {node.failures.map((failure) => (
        <p key={failure} class="bad failure">
          {failure}
        </p>
      ))}
      {session.maySteer.value && node.is_busflow && <Steering session={session} node={node} />}
      <Facts node={node} />
      {node.timers.length > 0 && <Timers timers={node.timers} />}
      <Ends title="Publishes" topics={node.publishers.filter((name) => !hidden.has(name))} node={node.name} kind="publish" onSelect={onSelect} />
      <Ends title="Receives" topics={node.subscriptions.filter((name) => !hidden.has(name))} node={node.name} kind="deliver" onSelect={onSelect} />
      <Served title="Services" services={own.filter((service) => !service.is_action)} onSelect={onSelect} />
      <Served title="Actions" services={own.filter((service) => service.is_action)} onSelect={onSelect} />
      {node.is_busflow && session.source.value === "run" && (
        <Section title="Parameters">
          <ParameterForm session={session} node={node.name} />
        </Section>
      )}
    </>
  );
}

interface ServedProps {
  readonly title: string;
  readonly services: readonly GraphService[];
  readonly onSelect: (id: string) => void;
}

/** The services or the actions that a node serves. */
function Served({ title, services, onSelect }: ServedProps) {
  if (services.length === 0) return null;
  return (
    <Section title={title}>
      <ul class="ends">
        {services.map((service) => (
          <li key={service.name}>
            <Link id={vertexId(serviceKind(service), service.name)} onSelect={onSelect}>
              {service.name}
            </Link>
          </li>
        ))}
      </ul>
    </Section>
  );
}

function Facts({ node }: { readonly node: GraphNode }) {
  const rows: readonly (readonly [string, ComponentChild])[] = [
    ["Plugin", node.plugin],
    ["Source", node.source === null ? null : <span title={node.source}>{shortPath(node.source)}</span>],
    ["Process", node.process === null ? null : `${node.process}${node.pid === null ? "" : ` (${node.pid})`}`],
    ["Machine", node.machine],
    ["Depends on", node.depends_on.join(", ") || null],
  ];
  return (
    <dl class="facts">
      {rows.map(([name, value]) =>
        value === null ? null : (
          <Fragment key={name}>
            <dt>{name}</dt>
            <dd class="mono">{value}</dd>
          </Fragment>
        ),
      )}
    </dl>
  );
}

/** Returns a path without all but its last folder. */
function shortPath(path: string): string {
  return path.split("/").slice(-2).join("/");
}

/** Restart, stop or start, and the level of its log; what came of it is said below. */
function Steering({ session, node }: { readonly session: Session; readonly node: GraphNode }) {
  const said = useSignal<{ readonly text: string; readonly isBad: boolean } | null>(null);
  const attempt = async (done: string, ask: () => Promise<unknown>) => {
    said.value = null;
    try {
      await ask();
      said.value = { text: done, isBad: false };
    } catch (reason) {
      said.value = { text: errorText(reason), isBad: true };
    }
  };
  const order = (word: "start" | "stop" | "restart", done: string) => () =>
    void attempt(done, () => session.questions.ask("order", { node: node.name, order: word }));
  const isStopped = toneOf(node.state) === "stopped" || toneOf(node.state) === "bad";
  return (
    <>
      <div class="buttons">
        <button type="button" class="button" onClick={order("restart", "It restarts.")}>
          Restart
        </button>
        {isStopped ? (
          <button type="button" class="button" onClick={order("start", "It starts.")}>
            Start
          </button>
        ) : (
          <button type="button" class="button" onClick={order("stop", "It stops.")}>
            Stop
          </button>
        )}
        <select
          aria-label="Log level"
          value=""
          onChange={(event) => {
            const level = event.currentTarget.value;
            event.currentTarget.value = "";
            void attempt(`It logs from ${level} on.`, () =>
              session.questions.ask("log_level", { node: node.name, level }),
            );
          }}
        >
          <option value="" disabled>
            Log level
          </option>
          {LEVELS.map(([, word]) => (
            <option key={word}>{word}</option>
          ))}
        </select>
      </div>
      <p class={`small said ${said.value?.isBad === true ? "bad" : "quiet"}`} role="status">
        {said.value?.text}
      </p>
    </>
  );
}

function Timers({ timers }: { readonly timers: readonly Timer[] }) {
  return (
    <Section title="Timers">
      <table class="table timers">
        <thead>
          <tr>
            <th scope="col">fired</th>
            <th scope="col">missed</th>
            <th scope="col" title="Half of the ticks are later than this">
              late p50
            </th>
            <th scope="col" title="One tick of a hundred is later than this">
              late p99
            </th>
          </tr>
        </thead>
        {timers.map((timer) => (
          <tbody key={timer.name}>
            <tr>
              <th scope="rowgroup" colSpan={4} title={rateText(1 / timer.period_s)}>
                <span class="mono">{timer.name}</span> every {secondsText(timer.period_s)}
              </th>
            </tr>
            <tr>
              <td>{countText(timer.fired)}</td>
              <td class={timer.missed > 0 ? "bad" : ""}>{countText(timer.missed)}</td>
              <td>{latenessText(timer.lateness_p50_s)}</td>
              <td>{latenessText(timer.lateness_p99_s)}</td>
            </tr>
          </tbody>
        ))}
      </table>
    </Section>
  );
}

const latenessText = (seconds: number | null): string => (seconds === null ? "–" : secondsText(seconds));

interface EndsProps {
  readonly title: string;
  readonly topics: readonly string[];
  readonly node: string;
  readonly kind: "publish" | "deliver";
  readonly onSelect: (id: string) => void;
}

function Ends({ title, topics, node, kind, onSelect }: EndsProps) {
  if (topics.length === 0) return null;
  return (
    <Section title={title}>
      <ul class="ends">
        {topics.map((topic) => (
          <li key={topic}>
            <Link id={edgeId(kind, node, topic)} onSelect={onSelect}>
              {topic}
            </Link>
          </li>
        ))}
      </ul>
    </Section>
  );
}

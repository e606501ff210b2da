/** Parameters panel: the nodes, the form of each, and the way of the changes into the launch file. */
import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { SearchField } from "../../controls/search_field";
import type { PanelProps } from "../panel";
import { matcher } from "../../store/search";
import type { Session } from "../../store/session";
import { ParameterForm } from "./parameter_form";
import { SaveParameters } from "./save_parameters";
import "./parameters.css";

export function ParametersPanel({ session, settings, onSettings }: PanelProps) {
  const search = useSignal("");
  const nodes = useNodes(session);
  const chosen = nodes.find((name) => name === settings.node) ?? null;
  const shown = chosen === null ? nodes : [chosen];
  const matches = matcher(search.value);
  return (
    <>
      <div class="toolbar">
        <NodeChoice nodes={nodes} chosen={chosen} onChoose={(node) => onSettings(node === null ? {} : { node })} />
        <SearchField label="Search parameters" value={search.value} onSearch={(text) => (search.value = text)} />
        <span class="grow" />
        {session.maySteer.value && session.answersQuestions.value && <SaveParameters session={session} node={chosen} />}
      </div>
      <div class="scroll">
        {nodes.length === 0 && (
          <p class="empty">
            <strong>No nodes</strong>
          </p>
        )}
        <div class="parameter-cards">
          {shown.map((name) => (
            <section key={name} class="parameter-card" aria-label={`Parameters of ${name}`}>
              <h3>{name}</h3>
              <ParameterForm
                session={session}
                node={name}
                matches={(parameter) => matches(`${parameter.name} ${parameter.description ?? ""}`)}
              />
            </section>
          ))}
        </div>
      </div>
    </>
  );
}

/** The nodes that have parameters: busflow's own of a run, or those that another server names. */
function useNodes(session: Session): readonly string[] {
  const [isOpen, isRun] = [session.isOpen.value, session.answersQuestions.value];
  useEffect(() => {
    // The form of a node says what went wrong; without an answer there is none, and no node.
    if (isOpen && !isRun) session.serverParameters.readAll().catch(() => undefined);
  }, [session, isOpen, isRun]);
  if (!isRun) return session.serverParameters.nodes.value;
  const nodes = session.graph.value?.graph.nodes ?? [];
  return nodes.filter((node) => !node.hidden && node.is_busflow).map(({ name }) => name);
}

interface ChoiceProps {
  readonly nodes: readonly string[];
  readonly chosen: string | null;
  readonly onChoose: (node: string | null) => void;
}

function NodeChoice({ nodes, chosen, onChoose }: ChoiceProps) {
  return (
    <select
      aria-label="Node"
      value={chosen ?? ""}
      onChange={(event) => onChoose(event.currentTarget.value === "" ? null : event.currentTarget.value)}
    >
      <option value="">All nodes</option>
      {nodes.map((name) => (
        <option key={name} value={name}>
          {name}
        </option>
      ))}
    </select>
  );
}

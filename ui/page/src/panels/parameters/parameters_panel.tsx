/** Parameters panel: the nodes, the form of each, and the way of the changes into the launch file. */
import { useSignal } from "@preact/signals";
import type { GraphNode } from "../../connection/answers";
import { SearchField } from "../../controls/search_field";
import type { PanelProps } from "../panel";
import { matcher } from "../../store/search";
import { ParameterForm } from "./parameter_form";
import { SaveParameters } from "./save_parameters";
import "./parameters.css";

export function ParametersPanel({ session, settings, onSettings }: PanelProps) {
  const search = useSignal("");
  const nodes = (session.graph.value?.graph.nodes ?? []).filter((node) => !node.hidden && node.is_busflow);
  const chosen = nodes.find(({ name }) => name === settings.node)?.name ?? null;
  const shown = chosen === null ? nodes : nodes.filter(({ name }) => name === chosen);
  const matches = matcher(search.value);
  return (
    <>
      <div class="toolbar">
        <NodeChoice nodes={nodes} chosen={chosen} onChoose={(node) => onSettings(node === null ? {} : { node })} />
        <SearchField label="Search parameters" value={search.value} onSearch={(text) => (search.value = text)} />
        <span class="grow" />
        {session.maySteer.value && <SaveParameters session={session} node={chosen} />}
      </div>
      <div class="scroll">
        {nodes.length === 0 && (
          <p class="empty">
            <strong>No nodes</strong>
          </p>
        )}
        <div class="parameter-cards">
          {shown.map(({ name }) => (
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

interface ChoiceProps {
  readonly nodes: readonly GraphNode[];
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
      {nodes.map(({ name }) => (
        <option key={name} value={name}>
          {name}
        </option>
      ))}
    </select>
  );
}

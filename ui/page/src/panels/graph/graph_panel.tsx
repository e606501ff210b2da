/** Graph panel: the live drawing of the run, with a list and the details of what is selected beside it. */
import type { GraphNode } from "../../connection/answers";
import { matcher } from "../../store/search";
import type { GraphState } from "../../store/session";
import type { PanelProps } from "../panel";
import { Details } from "./details";
import { Drawing } from "./drawing";
import { folded, foldedGroups } from "./folding";
import { List } from "./list";
import { graphModel, usefulGroupings, vertexId, type GraphModel, type Grouping, type Vertex } from "./model";
import { readSettings, writeSettings, type GraphSettings } from "./settings";
import { GraphToolbar } from "./toolbar";
import "./graph.css";

export function GraphPanel({ session, settings, onSettings }: PanelProps) {
  const state = session.graph.value;
  if (state === null) {
    return (
      <div class="empty" aria-busy={session.isOpen.value}>
        <strong>{nothingText(session)}</strong>
      </div>
    );
  }
  return <LiveGraph session={session} settings={settings} onSettings={onSettings} state={state} />;
}

function nothingText({ isOpen, hasGraph }: PanelProps["session"]): string {
  if (!isOpen.value) return "Not connected";
  return hasGraph.value ? "Reading the graph" : "This server does not say which nodes there are";
}

function LiveGraph({ session, settings, onSettings, state }: PanelProps & { readonly state: GraphState }) {
  const chosen = readSettings(settings);
  const change = (changed: Partial<GraphSettings>) => onSettings(writeSettings({ ...chosen, ...changed }));
  const grouping = chosen.grouping ?? usualGrouping(state.graph.nodes);
  const model = graphModel(state.graph, state.rates, { ...chosen, grouping });
  const matches = matcher(chosen.search);
  const selected = isThere(chosen.selected, model) ? chosen.selected : null;
  const groups = foldedGroups(model, new Set(chosen.toggled), selected);
  const drawn = folded(model, groups);
  const toggle = (...names: readonly string[]) => {
    const others = chosen.toggled.filter((each) => !names.includes(each));
    change({ selected: null, toggled: [...others, ...names.filter((each) => !chosen.toggled.includes(each))] });
  };
  const isOpenBySelection = (group: string) => foldedGroups(model, new Set(chosen.toggled), null).has(group);
  const onSelect = (id: string | null) => {
    const opened = id === null ? [] : [...groups].filter((group) => isPartOf(group, id, drawn));
    if (opened.length > 0) toggle(...opened);
    else change({ selected: id });
  };
  return (
    <div class="graph">
      <div class="graph-stage">
        <GraphToolbar graph={state.graph} settings={chosen} grouping={grouping} onChange={change} />
        {model.vertices.length > 0 ? (
          <Drawing
            model={drawn}
            selected={selected}
            matches={(vertex) => isFound(vertex, model, matches)}
            onSelect={onSelect}
            onFold={(group) => (isOpenBySelection(group) ? change({ selected: null }) : toggle(group))}
          />
        ) : (
          <div class="empty">
            <strong>No nodes</strong>
          </div>
        )}
      </div>
      <aside class="graph-side" aria-label="List and details">
        {selected === null ? (
          <List model={model} search={chosen.search} onSearch={(search) => change({ search })} onSelect={onSelect} />
        ) : (
          <Details session={session} state={state} selected={selected} onSelect={onSelect} />
        )}
      </aside>
    </div>
  );
}

/** Groups by namespace where there are several, else by process where there are several. */
function usualGrouping(nodes: readonly GraphNode[]): Grouping {
  return usefulGroupings(nodes)[0] ?? "none";
}

/** Whether an id stands for a folded group, or for what goes to or from it. */
function isPartOf(group: string, id: string, { edges }: GraphModel): boolean {
  const own = vertexId("group", group);
  return id === own || edges.some((edge) => edge.id === id && (edge.from === own || edge.to === own));
}

/** Whether a vertex has a name that is searched for; a folded group, whether a member has. */
function isFound({ kind, name }: Vertex, model: GraphModel, matches: (name: string) => boolean): boolean {
  if (kind !== "group") return matches(name);
  return model.vertices.some((vertex) => vertex.group === name && matches(vertex.name));
}

function isThere(selected: string | null, model: GraphModel): boolean {
  return [...model.vertices, ...model.edges].some(({ id }) => id === selected);
}

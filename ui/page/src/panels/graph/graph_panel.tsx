/** Graph panel: the live drawing of the run, with a list and the details of what is selected beside it. */
import type { GraphNode } from "../../connection/answers";
import type { GraphState } from "../../store/session";
import type { PanelProps, Settings } from "../panel";
import { Details } from "./details";
import { Drawing } from "./drawing";
import { List } from "./list";
import { graphModel, usefulGroupings, type GraphModel, type Grouping } from "./model";
import { matcher } from "../../store/search";
import { GraphToolbar } from "./toolbar";
import "./graph.css";

/** What the panel remembers. */
export interface GraphSettings {
  readonly grouping: Grouping | null;
  readonly services: boolean;
  readonly hidden: boolean;
  readonly selected: string | null;
  readonly search: string;
}

const GROUPINGS: readonly Grouping[] = ["none", "namespace", "process", "machine"];

export function readSettings(settings: Settings): GraphSettings {
  return {
    grouping: GROUPINGS.find((each) => each === settings.grouping) ?? null,
    services: settings.services === true,
    hidden: settings.hidden === true,
    selected: typeof settings.selected === "string" ? settings.selected : null,
    search: typeof settings.search === "string" ? settings.search : "",
  };
}

/** Returns the settings to remember: those that differ from the usual ones. */
function writeSettings(settings: GraphSettings): Settings {
  return Object.fromEntries(Object.entries(settings).filter(([, value]) => value !== null && value !== false && value !== ""));
}

export function GraphPanel({ session, settings, onSettings }: PanelProps) {
  const state = session.graph.value;
  if (state === null) {
    return (
      <div class="empty" aria-busy={session.isOpen.value}>
        <strong>{session.isOpen.value ? "Reading the graph" : "Not connected"}</strong>
      </div>
    );
  }
  return <LiveGraph session={session} settings={settings} onSettings={onSettings} state={state} />;
}

function LiveGraph({ session, settings, onSettings, state }: PanelProps & { readonly state: GraphState }) {
  const chosen = readSettings(settings);
  const change = (changed: Partial<GraphSettings>) => onSettings(writeSettings({ ...chosen, ...changed }));
  const grouping = chosen.grouping ?? usualGrouping(state.graph.nodes);
  const model = graphModel(state.graph, state.rates, { ...chosen, grouping });
  const matches = matcher(chosen.search);
  const onSelect = (selected: string | null) => change({ selected });
  const selected = isThere(chosen.selected, model) ? chosen.selected : null;
  return (
    <div class="graph">
      <div class="graph-stage">
        <GraphToolbar graph={state.graph} settings={chosen} grouping={grouping} onChange={change} />
        {model.vertices.length > 0 ? (
          <Drawing
            model={model}
            selected={selected}
            matches={({ name }) => matches(name)}
            onSelect={onSelect}
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

function isThere(selected: string | null, model: GraphModel): boolean {
  return [...model.vertices, ...model.edges].some(({ id }) => id === selected);
}

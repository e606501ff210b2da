/** What is drawn of the graph: its grouping, its services, what is hidden. */
import type { Graph } from "../../connection/answers";
import { Check } from "../../controls/check";
import { counted } from "../../store/text";
import { isHidden, usefulGroupings, type Grouping } from "./model";
import type { GraphSettings } from "./settings";

interface ToolbarProps {
  readonly graph: Graph;
  readonly settings: GraphSettings;
  readonly grouping: Grouping;
  readonly onChange: (changed: Partial<GraphSettings>) => void;
}

export function GraphToolbar({ graph, settings, grouping, onChange }: ToolbarProps) {
  const groupings = usefulGroupings(graph.nodes);
  return (
    <div class="toolbar">
      <span class="graph-sum">{sumOf(graph)}</span>
      <span class="grow" />
      {groupings.length > 0 && (
        <label class="check">
          Group by
          <select value={grouping} onChange={(event) => onChange({ grouping: event.currentTarget.value as Grouping })}>
            <option value="none">nothing</option>
            {groupings.map((each) => (
              <option key={each} value={each}>
                {each}
              </option>
            ))}
          </select>
        </label>
      )}
      <Check label="Services and actions" on={settings.services} onChange={(services) => onChange({ services })} />
      <Check label="Hidden" on={settings.hidden} onChange={(hidden) => onChange({ hidden })} />
    </div>
  );
}

/** The graph in one line. */
function sumOf(graph: Graph) {
  const nodes = graph.nodes.filter(({ hidden }) => !hidden);
  const topics = graph.topics.filter((topic) => !isHidden(topic));
  const dropped = topics.flatMap(({ subscriptions }) => subscriptions).reduce((sum, end) => sum + (end.dropped ?? 0), 0);
  const failed = nodes.filter(({ state }) => state === "failed").length;
  return (
    <>
      {counted(nodes.length, "node")}, {counted(topics.length, "topic")}
      {failed > 0 && <span class="bad"> · {counted(failed, "node")} failed</span>}
      {dropped > 0 && <span class="bad"> · {counted(dropped, "message")} dropped</span>}
    </>
  );
}

/** List: the same graph as rows, to read, to search, and for screen readers. */
import { SearchField } from "../../controls/search_field";
import type { Edge, GraphModel, Vertex } from "./model";
import { matcher } from "../../store/search";
import { Sign } from "./sign";

interface ListProps {
  readonly model: GraphModel;
  readonly search: string;
  readonly onSearch: (search: string) => void;
  readonly onSelect: (id: string) => void;
}

const TITLES: Readonly<Record<Vertex["kind"], string>> = { node: "Nodes", topic: "Topics", service: "Services", action: "Actions", group: "Groups" };

export function List({ model, search, onSearch, onSelect }: ListProps) {
  const matches = matcher(search);
  const found = model.vertices.filter(({ name }) => matches(name));
  const kinds = (Object.keys(TITLES) as Vertex["kind"][]).filter((kind) => found.some((vertex) => vertex.kind === kind));
  return (
    <>
      <SearchField
        label="Search nodes and topics"
        value={search}
        onSearch={onSearch}
        onEnter={() => found[0] !== undefined && onSelect(found[0].id)}
      />
      <div class="graph-list">
        {kinds.map((kind) => (
          <section key={kind}>
            <h3>{TITLES[kind]}</h3>
            <ul>
              {found
                .filter((vertex) => vertex.kind === kind)
                .map((vertex) => (
                  <Row key={vertex.id} vertex={vertex} label={dropLabel(vertex, model.edges)} onSelect={onSelect} />
                ))}
            </ul>
          </section>
        ))}
        {found.length === 0 && <p class="empty">Nothing has this name.</p>}
      </div>
    </>
  );
}

interface RowProps {
  readonly vertex: Vertex;
  readonly label: string | null;
  readonly onSelect: (id: string) => void;
}

function Row({ vertex, label, onSelect }: RowProps) {
  return (
    <li>
      <button type="button" class="row" onClick={() => onSelect(vertex.id)}>
        {vertex.kind === "node" && <Sign tone={vertex.tone} />}
        <span class={`row-name ${vertex.kind === "node" ? "" : "mono"}`}>{vertex.name}</span>
        {label !== null && <span class="bad small">{label}</span>}
        <span class="quiet small">{vertex.detail}</span>
      </button>
    </li>
  );
}

/** What a row says of drops: those of a topic's receivers, or of what a node receives. */
function dropLabel(vertex: Vertex, edges: readonly Edge[]): string | null {
  const dropping = edges.filter((edge) => edge.label !== null && (edge.from === vertex.id || edge.to === vertex.id));
  if (dropping.length > 1) return `drops at ${dropping.length} ends`;
  return dropping[0]?.label ?? null;
}

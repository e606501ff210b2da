/** Folding: groups of a graph drawn as one vertex each, with the edges that leave them. Pure. */
import { counted, rateText } from "../../store/text";
import { edgeLook, edgeWidth, vertexId, type Edge, type GraphModel, type Tone, type Vertex } from "./model";

/** Vertices from which on groups are folded until a person opens them. */
const MANY = 60;
const WORST_FIRST: readonly Tone[] = ["bad", "waiting", "stopped", "good", "none"];

/** Whether an id is that of a folded group, or of the edges between two of them. */
export function isOfGroup(id: string): boolean {
  return id.startsWith("group ") || id.startsWith("bundle ");
}

/** Returns the groups that are folded: all of a large graph, else none, but for those that a person has toggled. */
export function foldedGroups(model: GraphModel, toggled: ReadonlySet<string>, selected: string | null): ReadonlySet<string> {
  const isLarge = model.vertices.length > MANY;
  const groups = new Set(model.vertices.flatMap(({ group }) => group ?? []));
  const shown = selected === null ? [] : endsOf(model, selected);
  const opened = new Set(model.vertices.filter(({ id }) => shown.includes(id)).map(({ group }) => group));
  return new Set([...groups].filter((group) => isLarge !== toggled.has(group) && !opened.has(group)));
}

/** Returns the vertices that a selection is about. */
function endsOf(model: GraphModel, selected: string): readonly string[] {
  const edge = model.edges.find(({ id }) => id === selected);
  return edge === undefined ? [selected] : [edge.from, edge.to];
}

/** Returns the model with these groups as one vertex each; what is within a group is not drawn. */
export function folded(model: GraphModel, groups: ReadonlySet<string>): GraphModel {
  if (groups.size === 0) return model;
  const members = new Map<string, Vertex[]>([...groups].map((group) => [group, []]));
  const places = new Map<string, string>();
  for (const vertex of model.vertices) {
    const own = vertex.group === null ? undefined : members.get(vertex.group);
    own?.push(vertex);
    places.set(vertex.id, own === undefined ? vertex.id : vertexId("group", vertex.group ?? ""));
  }
  const bundles = new Map<string, [Edge, ...Edge[]]>();
  const kept: Edge[] = [];
  for (const edge of model.edges) {
    const [from, to] = [places.get(edge.from) ?? edge.from, places.get(edge.to) ?? edge.to];
    if (from === edge.from && to === edge.to) kept.push(edge);
    else if (from !== to) {
      const key = `${from}\n${to}`;
      const known = bundles.get(key);
      if (known === undefined) bundles.set(key, [{ ...edge, from, to }]);
      else known.push(edge);
    }
  }
  const vertices = model.vertices.filter(({ id }) => places.get(id) === id);
  return {
    vertices: [...vertices, ...[...members].map(([group, own]) => groupVertex(group, own))],
    edges: [...kept, ...[...bundles.values()].map(bundle)],
  };
}

function groupVertex(name: string, members: readonly Vertex[]): Vertex {
  const count = (kind: Vertex["kind"]): number => members.filter((each) => each.kind === kind).length;
  const tones = new Set(members.filter(({ kind }) => kind === "node").map(({ tone }) => tone));
  const detail = `${counted(count("node"), "node")}, ${counted(count("topic"), "topic")}`;
  return {
    id: vertexId("group", name),
    kind: "group",
    name,
    label: name,
    detail,
    tone: WORST_FIRST.find((tone) => tones.has(tone)) ?? "none",
    group: null,
    sentence: `${name} ${detail}, folded; opens`,
  };
}

/** Returns edges between the same two vertices as one. */
function bundle(edges: readonly [Edge, ...Edge[]]): Edge {
  const { from, to } = edges[0];
  const rates = edges.flatMap(({ rateHz }) => rateHz ?? []);
  const rateHz = rates.length === 0 ? null : rates.reduce((sum, each) => sum + each, 0);
  const dropped = edges.reduce((sum, each) => sum + each.dropped, 0);
  const label = dropped > 0 ? counted(dropped, "dropped", "dropped") : null;
  const said = [counted(edges.length, "edge"), ...(rateHz === null ? [] : [rateText(rateHz)]), ...(label === null ? [] : [label])];
  return {
    id: `bundle ${from} ${to}`,
    kind: "bundle",
    from,
    to,
    node: "",
    name: "",
    look: edgeLook(rateHz, dropped),
    rateHz,
    dropped,
    width: edgeWidth(rateHz),
    label,
    sentence: `from ${nameOf(from)} to ${nameOf(to)}: ${said.join(", ")}`,
  };
}

const nameOf = (id: string): string => id.slice(id.indexOf(" ") + 1);

/** Details: what is selected in the graph, with the way back to the list. */
import { Icon } from "../../controls/icons";
import type { DetailsProps } from "./details_parts";
import { EdgeDetails } from "./edge_details";
import { edgeId, serviceKind, vertexId, type EdgeKind } from "./model";
import { NodeDetails } from "./node_details";
import { ServiceDetails, TopicDetails } from "./topic_details";

const EDGE_KINDS: readonly EdgeKind[] = ["publish", "deliver", "call", "serve"];

export function Details(props: DetailsProps) {
  return (
    <div class="details">
      <button type="button" class="button plain details-back" onClick={() => props.onSelect(null)}>
        <Icon name="back" /> All
      </button>
      <Selected {...props} />
    </div>
  );
}

function Selected(props: DetailsProps) {
  const { state, selected } = props;
  const { nodes, topics, services } = state.graph;
  const node = nodes.find(({ name }) => vertexId("node", name) === selected);
  if (node !== undefined) return <NodeDetails {...props} node={node} />;
  const topic = topics.find(({ name }) => vertexId("topic", name) === selected);
  if (topic !== undefined) return <TopicDetails {...props} topic={topic} />;
  const service = services.find((each) => vertexId(serviceKind(each), each.name) === selected);
  if (service !== undefined) return <ServiceDetails {...props} service={service} />;
  for (const kind of EDGE_KINDS) {
    const is = (end: { node: string }, name: string) => edgeId(kind, end.node, name) === selected;
    const own = topics.find((each) => [...each.publishers, ...each.subscriptions].some((end) => is(end, each.name)));
    if (own !== undefined && (kind === "publish" || kind === "deliver")) {
      const ends = kind === "publish" ? own.publishers : own.subscriptions;
      const end = ends.find((each) => is(each, own.name));
      if (end !== undefined) return <EdgeDetails {...props} topic={own} node={end.node} isDelivery={kind === "deliver"} />;
    }
    const called = services.find((each) => [...each.servers, ...each.clients].some((end) => is(end, each.name)));
    if (called !== undefined) return <ServiceDetails {...props} service={called} />;
  }
  return <p class="quiet">It has gone.</p>;
}

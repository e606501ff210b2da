/** Topic and service details: the ends of each, with what they count. */
import { Fragment } from "preact";
import type { GraphService, GraphTopic, ServiceEnd } from "../../connection/answers";
import { deliverKey, publishKey } from "../../store/rates";
import { countText, rateText } from "../../store/text";
import { Heading, Link, Section, type DetailsProps } from "./details_parts";
import { LastMessage } from "./last_message";
import { edgeId, goalsText, topicRate, vertexId } from "./model";

export function TopicDetails({ session, state, topic, onSelect }: DetailsProps & { readonly topic: GraphTopic }) {
  const rate = topicRate(topic, state.rates);
  const losses = Object.entries(topic.losses).filter(([, count]) => count > 0);
  return (
    <>
      <Heading kind="Topic">
        <span class="mono">{topic.name}</span>
      </Heading>
      <dl class="facts">
        <dt>Type</dt>
        <dd class="mono">{topic.type}</dd>
        <dt>Rate</dt>
        <dd>{rate === null ? "–" : rateText(rate)}</dd>
        <dt>Published</dt>
        <dd>{countText(topic.published)}</dd>
        {losses.map(([reason, count]) => (
          <Fragment key={reason}>
            <dt class="bad">Lost</dt>
            <dd class="bad">
              {countText(count)} {reason.replaceAll("_", " ")}
            </dd>
          </Fragment>
        ))}
      </dl>
      <Section title="Publishers">
        <EndTable
          names={topic.publishers.map((end) => end.node)}
          rate={(node) => state.rates.get(publishKey(topic.name, node))}
          id={(node) => edgeId("publish", node, topic.name)}
          onSelect={onSelect}
        />
      </Section>
      <Section title="Subscriptions">
        <EndTable
          names={topic.subscriptions.map((end) => end.node)}
          rate={(node) => state.rates.get(deliverKey(topic.name, node))}
          dropped={(node) =>
            topic.subscriptions.filter((end) => end.node === node).reduce((sum, end) => sum + (end.dropped ?? 0), 0)
          }
          id={(node) => edgeId("deliver", node, topic.name)}
          onSelect={onSelect}
        />
      </Section>
      <LastMessage session={session} topic={topic.name} />
    </>
  );
}

interface EndTableProps {
  readonly names: readonly string[];
  readonly rate: (node: string) => number | undefined;
  readonly dropped?: (node: string) => number;
  readonly id: (node: string) => string;
  readonly onSelect: (id: string) => void;
}

function EndTable({ names, rate, dropped = () => 0, id, onSelect }: EndTableProps) {
  const nodes = [...new Set(names)];
  if (nodes.length === 0) return <p class="quiet">None</p>;
  return (
    <ul class="ends">
      {nodes.map((node) => {
        const hz = rate(node);
        const lost = dropped(node);
        return (
          <li key={node}>
            <Link id={id(node)} onSelect={onSelect}>
              {node}
            </Link>
            {lost > 0 && <span class="bad small">{countText(lost)} dropped</span>}
            <span class="quiet small">{hz === undefined ? "" : rateText(hz)}</span>
          </li>
        );
      })}
    </ul>
  );
}

export function ServiceDetails({ service, onSelect }: DetailsProps & { readonly service: GraphService }) {
  return (
    <>
      <Heading kind={service.is_action ? "Action" : "Service"}>
        <span class="mono">{service.name}</span>
      </Heading>
      <dl class="facts">
        <dt>Type</dt>
        <dd class="mono">{service.type}</dd>
      </dl>
      <Section title="Servers">
        <NodeLinks ends={service.servers} onSelect={onSelect} />
      </Section>
      <Section title="Clients">
        <NodeLinks ends={service.clients} onSelect={onSelect} />
      </Section>
    </>
  );
}

interface NodeLinksProps {
  readonly ends: readonly ServiceEnd[];
  readonly onSelect: (id: string) => void;
}

function NodeLinks({ ends, onSelect }: NodeLinksProps) {
  if (ends.length === 0) return <p class="quiet">None</p>;
  return (
    <ul class="ends">
      {[...new Set(ends.map((end) => end.node))].map((name) => (
        <li key={name}>
          <Link id={vertexId("node", name)} onSelect={onSelect}>
            {name}
          </Link>
          {ends
            .filter((end) => end.node === name)
            .map((end, at) => (
              <span key={at} class="quiet small">
                {goalsText(end)}
              </span>
            ))}
        </li>
      ))}
    </ul>
  );
}

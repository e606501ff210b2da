/** Edge details: the ledger, the rate and the QoS of both ends of what one node publishes or receives. */
import type { GraphTopic, TopicPublisher, TopicSubscription } from "../../connection/answers";
import { deliverKey } from "../../store/rates";
import { countText, rateText } from "../../store/text";
import { Heading, Link, Section, type DetailsProps } from "./details_parts";
import { LastMessage } from "./last_message";
import { ledgerOf } from "./ledger";
import { publishRate, vertexId } from "./model";
import { qosRows } from "./qos";

interface EdgeProps extends DetailsProps {
  readonly topic: GraphTopic;
  readonly node: string;
  readonly isDelivery: boolean;
}

export function EdgeDetails({ session, state, topic, node, isDelivery, onSelect }: EdgeProps) {
  const rate = isDelivery ? state.rates.get(deliverKey(topic.name, node)) : publishRate(topic, node, state.rates);
  const own = topic.subscriptions.filter((end) => end.node === node);
  const publishing = topic.publishers.filter((end) => end.node === node);
  const topicLink = (
    <Link id={vertexId("topic", topic.name)} onSelect={onSelect}>
      {topic.name}
    </Link>
  );
  const nodeLink = (
    <Link id={vertexId("node", node)} onSelect={onSelect}>
      {node}
    </Link>
  );
  return (
    <>
      <Heading kind={isDelivery ? "Node receives topic" : "Node publishes topic"}>
        {isDelivery ? topicLink : nodeLink} <span class="quiet">→</span> {isDelivery ? nodeLink : topicLink}
      </Heading>
      <dl class="facts">
        <dt>Rate</dt>
        <dd>{rate == null ? "–" : rateText(rate)}</dd>
        <dt>Type</dt>
        <dd class="mono">{topic.type}</dd>
        <dt>Declared</dt>
        <dd class="mono">{originsOf(isDelivery ? own : publishing)}</dd>
      </dl>
      {isDelivery ? (
        <LedgerSection subscriptions={own} />
      ) : (
        <Section title="Published">{publishedText(topic, publishing)}</Section>
      )}
      <QosSection publishers={isDelivery ? topic.publishers : publishing} subscriptions={isDelivery ? own : []} />
      <LastMessage session={session} topic={topic.name} />
    </>
  );
}

/** Returns how many messages a node has published; those of the topic where its publishers are not told apart. */
function publishedText(topic: GraphTopic, own: readonly TopicPublisher[]): string {
  const known = own.flatMap(({ published }) => published ?? []);
  if (known.length > 0) return countText(known.reduce((sum, each) => sum + each, 0));
  return `${countText(topic.published)}${topic.publishers.length > 1 ? " with others" : ""}`;
}

function originsOf(ends: readonly (TopicPublisher | TopicSubscription)[]): string {
  return [...new Set(ends.flatMap(({ origin }) => origin ?? []))].join(", ") || "–";
}

/** The equation of the ledger, and why messages were dropped. */
function LedgerSection({ subscriptions }: { readonly subscriptions: readonly TopicSubscription[] }) {
  const ledger = ledgerOf(subscriptions);
  if (ledger === null) return <Section title="Ledger">Another program receives it, which keeps no ledger.</Section>;
  const { published, delivered, dropped, queued, reasons } = ledger;
  const words = `${published} published = ${delivered} delivered + ${dropped} dropped + ${queued} queued`;
  return (
    <Section title="Ledger">
      <div class="ledger" role="img" aria-label={words}>
        <Term count={published} word="published" />
        <span class="quiet">=</span>
        <Term count={delivered} word="delivered" />
        <span class="quiet">+</span>
        <Term count={dropped} word="dropped" isBad={dropped > 0} />
        <span class="quiet">+</span>
        <Term count={queued} word="queued" />
      </div>
      {reasons.length > 0 && (
        <ul class="reasons">
          {reasons.map(([reason, count]) => (
            <li key={reason} class="bad">
              {countText(count)} {REASONS[reason] ?? reason}
            </li>
          ))}
        </ul>
      )}
    </Section>
  );
}

const REASONS: Readonly<Record<string, string>> = {
  overflow: "dropped: the queue was full",
  expired: "dropped: older than the lifespan",
  superseded: "dropped: a newer one came before",
  unmatched: "dropped: without a partner to match",
};

function Term({ count, word, isBad = false }: { readonly count: number; readonly word: string; readonly isBad?: boolean }) {
  return (
    <span class={`term ${isBad ? "bad" : ""}`}>
      <strong>{countText(count)}</strong>
      <span class="small">{word}</span>
    </span>
  );
}

interface QosProps {
  readonly publishers: readonly TopicPublisher[];
  readonly subscriptions: readonly TopicSubscription[];
}

/** QoS of both ends: what is offered beside what is requested. */
function QosSection({ publishers, subscriptions }: QosProps) {
  const offered = publishers[0]?.qos;
  const requested = subscriptions[0]?.qos;
  const some = offered ?? requested;
  if (some === undefined) return null;
  const rows = qosRows(offered ?? NOTHING, requested ?? NOTHING);
  return (
    <Section title="QoS">
      <table class="table">
        <thead>
          <tr>
            <td />
            {offered !== undefined && <th scope="col">offered</th>}
            {requested !== undefined && <th scope="col">requested</th>}
          </tr>
        </thead>
        <tbody>
          {rows.map((row) => {
            const isBad = !row.fits && offered !== undefined && requested !== undefined;
            return (
              <tr key={row.name} class={isBad ? "bad" : ""}>
                <th scope="row">
                  {row.name}
                  {isBad && " does not fit"}
                </th>
                {offered !== undefined && <td>{row.offered}</td>}
                {requested !== undefined && <td>{row.requested}</td>}
              </tr>
            );
          })}
        </tbody>
      </table>
      {publishers.length > 1 && <p class="quiet small">The first of {publishers.length} publishers.</p>}
    </Section>
  );
}

const NOTHING = { reliability: "", durability: "" };

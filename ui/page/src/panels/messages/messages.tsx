/** Messages: the topics with their rates, and the last message of one as a tree. */

import { useState } from "preact/hooks";
import type { Channel } from "../../connection/protocol";
import { SearchField } from "../../controls/search_field";
import { MessageTree } from "../../messages/tree";
import { matcher } from "../../store/search";
import type { Session } from "../../store/session";
import { rateText } from "../../store/text";
import type { PanelProps } from "../panel";
import "./messages.css";

export function Messages({ session, settings, onSettings }: PanelProps) {
  const channels = [...session.topics.channels.value.values()].sort((one, other) => one.topic.localeCompare(other.topic));
  const topic = typeof settings.topic === "string" ? settings.topic : channels[0]?.topic;
  const search = typeof settings.search === "string" ? settings.search : "";
  const [filter, setFilter] = useState("");
  const matches = matcher(filter);
  const found = channels.filter(({ topic: name, schemaName }) => matches(`${name} ${schemaName}`));
  return (
    <div class="messages">
      <div class="topics">
        <input
          class="field"
          type="search"
          aria-label="Filter the topics"
          placeholder="Filter"
          value={filter}
          onInput={(event) => setFilter(event.currentTarget.value)}
        />
        <TopicList session={session} channels={found} chosen={topic} onChoose={(name) => onSettings({ ...settings, topic: name })} />
      </div>
      <div class="message">
        {topic === undefined ? (
          <div class="empty">
            <strong>No topics</strong>
            <span>They appear here as soon as a node publishes one.</span>
          </div>
        ) : (
          <>
            <h2 class="message-topic">{topic}</h2>
            <SearchField label="Search the message" value={search} onSearch={(text) => onSettings({ ...settings, search: text })} />
            <MessageTree key={topic} session={session} topic={topic} search={search} />
          </>
        )}
      </div>
    </div>
  );
}

interface ListProps {
  readonly session: Session;
  readonly channels: readonly Channel[];
  readonly chosen: string | undefined;
  readonly onChoose: (topic: string) => void;
}

function TopicList({ session, channels, chosen, onChoose }: ListProps) {
  const rates = new Map((session.graph.value?.graph.topics ?? []).map((each) => [each.name, each.rate_hz]));
  if (channels.length === 0) return <p class="quiet small no-topic">No topic matches.</p>;
  return (
    <ul class="topic-list" aria-label="Topics">
      {channels.map(({ topic, schemaName }) => {
        const rateHz = rates.get(topic) ?? undefined;
        return (
          <li key={topic}>
            <button type="button" class="topic-row" aria-current={topic === chosen} title={schemaName} onClick={() => onChoose(topic)}>
              <span class="topic-name">{topic}</span>
              <span class="mono small quiet">{rateHz === undefined ? "" : rateText(rateHz)}</span>
            </button>
          </li>
        );
      })}
    </ul>
  );
}

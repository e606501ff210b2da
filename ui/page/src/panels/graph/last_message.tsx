/** The last message of a topic, below its other details. */
import { MessageTree } from "../../messages/tree";
import type { Session } from "../../store/session";
import { Section } from "./details_parts";

interface LastMessageProps {
  readonly session: Session;
  readonly topic: string;
}

export function LastMessage({ session, topic }: LastMessageProps) {
  if (!session.topics.channels.value.has(topic)) return null;
  return (
    <Section title="Last message">
      <MessageTree session={session} topic={topic} />
    </Section>
  );
}

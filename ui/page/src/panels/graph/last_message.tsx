/** The last message of a topic, below its other details. */
import type { Session } from "../../store/session";
import { Section } from "./details";

interface LastMessageProps {
  readonly session: Session;
  readonly topic: string;
}

export function LastMessage({ session, topic }: LastMessageProps) {
  const channel = session.topics.channels.value.get(topic);
  if (channel === undefined) return null;
  return <Section title="Last message">{channel.schemaName}</Section>;
}

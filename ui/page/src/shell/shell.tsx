/** Shell: the page around the panels. */
import type { Session } from "../store/session";

export function Shell({ session }: { readonly session: Session }) {
  const topics = [...session.topics.channels.value.keys()].sort();
  return (
    <main>
      <h1>{session.server.value?.name ?? "busflow"}</h1>
      <p role="status">{session.state.value.phase}</p>
      <ul>
        {topics.map((topic) => (
          <li key={topic}>{topic}</li>
        ))}
      </ul>
    </main>
  );
}

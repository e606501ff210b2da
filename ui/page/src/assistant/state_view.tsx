/** What answers, and where questions go; or what to do so that something answers. */
import type { AssistantState } from "../connection/answers";
import type { ConnectionState } from "../connection/connection";
import type { Session } from "../store/session";

export function StateView({ session }: { readonly session: Session }) {
  const [connection, assistant] = [session.state.value, session.assistant.value];
  return (
    <div class="assistant-state" role="status">
      {connection.phase === "open" ? <Running assistant={assistant} /> : <Apart connection={connection} />}
    </div>
  );
}

function Running({ assistant }: { readonly assistant: AssistantState | null }) {
  if (assistant === null) return <p>Looking for the assistant…</p>;
  if (assistant.starting === true) return <p>The assistant starts…</p>;
  if (!assistant.running) {
    return (
      <>
        <p class="warn">No assistant runs. Start it in a terminal, in the folder of busflow:</p>
        <HowToStart />
      </>
    );
  }
  const { host = "", model = "" } = assistant;
  if (host === "") return <p>Answers are quotes of the text. Nothing leaves this machine.</p>;
  return (
    <p class="assistant-host">
      Questions go to <strong>{host}</strong> with the sentences that are quoted, for its model {model}.
    </p>
  );
}

function Apart({ connection }: { readonly connection: ConnectionState }) {
  if (connection.phase === "refused") {
    return <p class="warn">This page may not ask: open it at the address that busflow ui prints. {connection.reason}</p>;
  }
  return (
    <>
      <p class="warn">No run answers. Start the assistant in a terminal, in the folder of busflow:</p>
      <HowToStart />
      {connection.phase === "waiting" && <p>{connection.reason}</p>}
    </>
  );
}

function HowToStart() {
  return (
    <pre tabIndex={0}>
      <code>{"pip install . ./assistant\nbusflow run configs/textbook.yaml"}</code>
    </pre>
  );
}

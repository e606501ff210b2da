/** Session: everything the page knows of the run it looks at, as signals, fed by one connection. */
import { computed, signal, type ReadonlySignal } from "@preact/signals";
import { Connection, type ConnectionState, type Socket } from "../connection/connection";
import type { ServerInfo, ServerMessage, StatusLevel } from "../connection/protocol";
import { Questions } from "../connection/questions";
import { Services } from "../connection/services";
import { Topics } from "../connection/topics";

export interface Status {
  readonly key: string;
  readonly level: StatusLevel;
  readonly message: string;
}

/** Steps that a person may take: steer the run, only look, or (a page with neither) find out. */
export type Source = "run" | "recording" | "bridge";

export interface SessionOptions {
  readonly url: string;
  readonly token: string;
  readonly open?: (url: string) => Socket;
}

const MOST_STATUSES = 50;

export class Session {
  readonly #state = signal<ConnectionState>({ phase: "connecting" });
  readonly #server = signal<ServerInfo | null>(null);
  readonly #statuses = signal<readonly Status[]>([]);
  readonly #connection: Connection;
  readonly topics: Topics;
  readonly services: Services;
  readonly questions: Questions;
  #statusIds = 0;

  constructor(options: SessionOptions) {
    this.#connection = new Connection({
      ...options,
      onState: (state) => this.#onState(state),
      onMessage: (message) => this.#onMessage(message),
    });
    this.topics = new Topics(this.#connection);
    this.services = new Services(this.#connection);
    this.questions = new Questions((operation) => this.#connection.send(operation));
  }

  get state(): ReadonlySignal<ConnectionState> {
    return this.#state;
  }

  /** What the server said of itself; kept after the connection has ended, so that the page stays readable. */
  get server(): ReadonlySignal<ServerInfo | null> {
    return this.#server;
  }

  /** Sentences of the server for the person at the page, oldest first, at most 50. */
  get statuses(): ReadonlySignal<readonly Status[]> {
    return this.#statuses;
  }

  readonly isOpen = computed(() => this.#state.value.phase === "open");
  readonly source = computed(() => (this.#server.value?.metadata?.source ?? "bridge") as Source);
  /** Whether the server answers busflow's questions. */
  readonly answersQuestions = computed(() => this.#server.value?.capabilities.includes("busflow") ?? false);
  /** Whether this page may change the run: false on a recording, with --read-only, and without a connection. */
  readonly maySteer = computed(
    () => this.isOpen.value && (this.#server.value?.capabilities.includes("clientPublish") ?? false),
  );

  connect(): void {
    this.#connection.connect();
  }

  close(): void {
    this.#connection.close();
  }

  /** Removes a status that the person has read. */
  dismiss(key: string): void {
    this.#statuses.value = this.#statuses.value.filter((status) => status.key !== key);
  }

  #onState(state: ConnectionState): void {
    const wasOpen = this.isOpen.value;
    this.#state.value = state;
    if (state.phase === "open") {
      this.topics.opened();
      this.questions.opened();
    } else if (wasOpen) {
      this.topics.ended();
      this.services.ended();
      this.questions.ended();
      this.#statuses.value = [];
    }
  }

  #onMessage(message: ServerMessage): void {
    if (message.op === "serverInfo") this.#server.value = message;
    else if (message.op === "status") this.#addStatus(message.level, message.message, message.id);
    else if (message.op === "removeStatus") {
      const gone = new Set(message.statusIds);
      this.#statuses.value = this.#statuses.value.filter((status) => !gone.has(status.key));
    }
    this.topics.handle(message);
    this.services.handle(message);
    this.questions.handle(message);
  }

  #addStatus(level: StatusLevel, message: string, id: string | undefined): void {
    const key = id ?? `#${(this.#statusIds += 1)}`;
    const others = this.#statuses.value.filter((status) => status.key !== key);
    this.#statuses.value = [...others, { key, level, message }].slice(-MOST_STATUSES);
  }
}

/** Session: everything the page knows of the run it looks at, as signals, fed by one connection. */
import { computed, signal, type ReadonlySignal, type Signal } from "@preact/signals";
import { Connection, type ConnectionState, type Socket } from "../connection/connection";
import type { ConnectionGraphUpdate, ServerInfo, ServerMessage, StatusLevel } from "../connection/protocol";
import { Questions } from "../connection/questions";
import { Services } from "../connection/services";
import { Topics } from "../connection/topics";
import type { AssistantState, Finding, Graph, LogLine, RecordingTime, Run } from "../connection/answers";
import { ConnectionGraph } from "./connection_graph";
import { followed } from "./followed";
import { Goals } from "./goals";
import { Rates, type RateTable } from "./rates";
import { ServerParameters } from "./server_parameters";

export interface Status {
  readonly key: string;
  readonly level: StatusLevel;
  readonly message: string;
}

/** What the page looks at: a run, a recording, or another server of Foxglove's protocol. */
export type Source = "run" | "recording" | "bridge";

export interface SessionOptions {
  readonly url: string;
  readonly token: string;
  readonly open?: (url: string) => Socket;
}

/** The graph as it is now, with its rates. */
export interface GraphState {
  readonly graph: Graph;
  readonly rates: RateTable;
}

/** Line of the log with a number of its own, by which the page tells it from others. */
export interface LogEntry extends LogLine {
  readonly key: number;
}

const MOST_STATUSES = 50;
const MOST_LINES = 5000;

export class Session {
  readonly #state = signal<ConnectionState>({ phase: "connecting" });
  readonly #server = signal<ServerInfo | null>(null);
  readonly #statuses = signal<readonly Status[]>([]);
  readonly #connection: Connection;
  readonly topics: Topics;
  readonly services: Services;
  readonly questions: Questions;
  readonly goals: Goals;
  /** Parameters of a server that answers no questions of busflow's. */
  readonly serverParameters: ServerParameters;
  /** Followed while a panel reads them; what was last known stays when the connection ends. */
  readonly graph: ReadonlySignal<GraphState | null>;
  readonly log: ReadonlySignal<readonly LogEntry[]>;
  readonly findings: ReadonlySignal<readonly Finding[] | null>;
  readonly run: ReadonlySignal<Run | null>;
  /** Where a recording stands; null of a run. */
  readonly time: ReadonlySignal<RecordingTime | null>;
  /** What answers questions about the text; null until that is known. */
  readonly assistant: ReadonlySignal<AssistantState | null>;
  /** How often parameters of each node were set while somebody reads this; by the node's name. */
  readonly parameterChanges: ReadonlySignal<ReadonlyMap<string, number>>;
  readonly #parameterChanges;
  /** The graph of a server that answers no questions of busflow's; another object with each change. */
  readonly #connections: Signal<ConnectionGraph | null>;
  #isGraphFollowed = false;
  readonly #connectionGraph = new ConnectionGraph();
  #isParametersFollowed = false;
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
    this.goals = new Goals(this.questions);
    this.serverParameters = new ServerParameters(this.#connection);
    this.#parameterChanges = signal<ReadonlyMap<string, number>>(new Map(), {
      watched: () => this.#followParameters(true),
      unwatched: () => this.#followParameters(false),
    });
    this.parameterChanges = this.#parameterChanges;
    const rates = new Rates();
    const runGraph = followed(this.questions, "graph", null as GraphState | null, (_, graph) => ({
      graph,
      rates: rates.update(graph),
    }));
    this.#connections = signal<ConnectionGraph | null>(null, {
      watched: () => this.#followConnections(true),
      unwatched: () => this.#followConnections(false),
    });
    this.graph = computed(() => {
      if (this.answersQuestions.value || this.#server.value === null) return runGraph.value;
      const connections = this.#connections.value;
      return connections && { graph: connections.graph(this.topics.channels.value), rates: new Map() };
    });
    let lines = 0;
    this.log = followed(this.questions, "log", [] as readonly LogEntry[], (before, answer, isFirst) => {
      const added = answer.lines.map((line) => ({ ...line, key: (lines += 1) }));
      const isWhole = isFirst || this.source.peek() === "recording"; // whose moment may go back
      return (isWhole ? added : [...before, ...added]).slice(-MOST_LINES);
    });
    this.findings = followed(this.questions, "health", null as readonly Finding[] | null, (_, answer) => answer.findings);
    this.run = followed(this.questions, "run", null as Run | null, (_, run) => run);
    this.assistant = followed(this.questions, "assistant", null as AssistantState | null, (_, state) => state);
    this.time = followed(this.questions, "time", null as RecordingTime | null, (_, time) => time);
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

  /** Whether the server says which nodes there are. */
  readonly hasGraph = computed(
    () => this.answersQuestions.value || (this.#server.value?.capabilities.includes("connectionGraph") ?? false),
  );

  #followConnections(on: boolean): void {
    this.#isGraphFollowed = on;
    if (this.answersQuestions.peek() || !this.hasGraph.peek()) return;
    this.#connection.send({ op: on ? "subscribeConnectionGraph" : "unsubscribeConnectionGraph" });
  }

  #onConnections(update: ConnectionGraphUpdate): void {
    this.#connectionGraph.update(update);
    this.#connections.value = this.#connectionGraph.copy();
  }

  #followParameters(on: boolean): void {
    this.#isParametersFollowed = on;
    const op = on ? "subscribeParameterUpdates" : "unsubscribeParameterUpdates";
    this.#connection.send({ op, parameterNames: [] });
  }

  #onParameters(names: readonly string[]): void {
    const counts = new Map(this.#parameterChanges.peek());
    const nodes = new Set(names.map((name) => name.slice(0, name.indexOf("."))));
    for (const node of nodes) counts.set(node, (counts.get(node) ?? 0) + 1);
    this.#parameterChanges.value = counts;
  }

  #onState(state: ConnectionState): void {
    const wasOpen = this.isOpen.value;
    this.#state.value = state;
    if (state.phase === "open") {
      this.topics.opened();
      if (this.#isParametersFollowed) this.#followParameters(true);
      if (this.answersQuestions.value) this.questions.opened();
      else if (this.#isGraphFollowed) this.#followConnections(true);
    } else if (wasOpen) {
      this.topics.ended();
      this.services.ended();
      this.questions.ended();
      this.serverParameters.ended();
      this.#connectionGraph.clear(); // the next connection begins with all of it
      this.#statuses.value = [];
    }
  }

  #onMessage(message: ServerMessage): void {
    if (message.op === "serverInfo") this.#server.value = message;
    else if (message.op === "status") this.#addStatus(message.level, message.message, message.id);
    else if (message.op === "parameterValues") this.#onParameters(message.parameters.map(({ name }) => name));
    else if (message.op === "connectionGraphUpdate") this.#onConnections(message);
    else if (message.op === "removeStatus") {
      const gone = new Set(message.statusIds);
      this.#statuses.value = this.#statuses.value.filter((status) => !gone.has(status.key));
    }
    this.topics.handle(message);
    this.services.handle(message);
    this.questions.handle(message);
    this.serverParameters.handle(message);
  }

  #addStatus(level: StatusLevel, message: string, id: string | undefined): void {
    const key = id ?? `#${(this.#statusIds += 1)}`;
    const others = this.#statuses.value.filter((status) => status.key !== key);
    this.#statuses.value = [...others, { key, level, message }].slice(-MOST_STATUSES);
  }
}

/** The answers to busflow's own questions, in the words of the server. */

/** QoS as a launch file writes it; of another program's end only its first words. */
export interface Qos {
  readonly reliability: string;
  readonly durability: string;
  readonly depth?: number | null;
  readonly overflow?: string | null;
  readonly deadline_s?: number | null;
  readonly lifespan_s?: number | null;
  readonly liveliness?: string | null;
  readonly lease_s?: number | null;
}

export interface Timer {
  readonly name: string;
  readonly period_s: number;
  readonly fired: number;
  readonly missed: number;
  readonly lateness_p50_s: number | null;
  readonly lateness_p99_s: number | null;
}

export interface GraphNode {
  readonly name: string;
  /** Null of nodes of other programs, of which the run knows no more than their ends. */
  readonly process: string | null;
  readonly machine: string | null;
  readonly pid: number | null;
  readonly namespace: string;
  readonly state: string;
  readonly plugin: string | null;
  /** Where its class is written, `file:line`. */
  readonly source: string | null;
  readonly restarts: number;
  readonly failures: readonly string[];
  readonly stopped_by_hand: number;
  readonly depends_on: readonly string[];
  /** False of a ROS 2 node's or a command's. */
  readonly is_busflow: boolean;
  readonly hidden: boolean;
  readonly timers: readonly Timer[];
  readonly publishers: readonly string[];
  readonly subscriptions: readonly string[];
  readonly services: readonly string[];
  readonly clients: readonly string[];
}

export interface TopicPublisher {
  readonly node: string;
  readonly qos: Qos;
  /** Null where another program publishes. */
  readonly published: number | null;
  /** The declaration that publishes, such as `SensorPublisher.imu`. */
  readonly origin: string | null;
}

export interface TopicSubscription {
  readonly node: string;
  readonly qos: Qos;
  /** The ledger, `published = delivered + dropped + queued`; null where another program receives. */
  readonly published: number | null;
  readonly delivered: number | null;
  readonly dropped: number | null;
  readonly queued: number | null;
  readonly origin: string | null;
  readonly depth: number | null;
  readonly overflow: string | null;
  /** Drops by reason. */
  readonly reasons: Readonly<Record<string, number>>;
  readonly deadlines_missed: number | null;
}

export interface GraphTopic {
  readonly name: string;
  readonly type: string;
  readonly hidden: boolean;
  /** Whether something outside the run publishes or receives it. */
  readonly external: boolean;
  readonly published: number;
  readonly rate_hz: number | null;
  readonly publishers: readonly TopicPublisher[];
  readonly subscriptions: readonly TopicSubscription[];
  readonly losses: Readonly<Record<string, number>>;
}

/** An end of a service; of an action's also what became of the goals, where busflow's processes count them. */
export interface ServiceEnd {
  readonly node: string;
  /** Goals that a server has received. */
  readonly received?: number;
  /** Goals that a client has sent. */
  readonly called?: number;
  readonly rejected?: number;
  readonly succeeded?: number;
  readonly aborted?: number;
  readonly canceled?: number;
  readonly running?: number;
  readonly queued?: number;
  readonly left?: number;
  readonly lost?: number;
}

/** A service, or an action. */
export interface GraphService {
  readonly name: string;
  readonly type: string;
  readonly is_action: boolean;
  readonly hidden: boolean;
  readonly servers: readonly ServiceEnd[];
  readonly clients: readonly ServiceEnd[];
}

export interface Graph {
  /** The run's own time; null where no process answers. */
  readonly elapsed_s: number | null;
  readonly nodes: readonly GraphNode[];
  readonly topics: readonly GraphTopic[];
  readonly services: readonly GraphService[];
}

export interface LogLine {
  readonly stamp_ns: number;
  /** ROS 2's number: 10 debug, 20 info, 30 warning, 40 error, 50 fatal. */
  readonly level: number;
  readonly node: string;
  readonly text: string;
  readonly process?: string;
}

export interface Finding {
  readonly severity: string;
  readonly code: string;
  readonly message: string;
  readonly fix: string | null;
  readonly file: string | null;
  readonly line: number | null;
}

export interface Bounds {
  readonly minimum: number | null;
  readonly maximum: number | null;
  readonly exclusive_minimum: boolean;
  readonly exclusive_maximum: boolean;
  readonly step: number | null;
}

export type ParameterValue = null | boolean | number | string | readonly ParameterValue[];

export interface Parameter {
  readonly name: string;
  /** Python's word, such as `float`, `list[float]` or `Literal['a', 'b']`. */
  readonly type: string;
  /** ROS 2's number of the type. */
  readonly ros_type: number | string;
  readonly value: ParameterValue;
  readonly default: ParameterValue;
  readonly required: boolean;
  readonly bounds: Bounds | null;
  /** The bounds in words. */
  readonly range: string | null;
  readonly choices: readonly ParameterValue[] | null;
  readonly description: string | null;
  readonly read_only: boolean;
  /** Where the declaration states one. */
  readonly unit?: string | null;
  /** Where the value came from: a place in a file, or a word such as `default`. */
  readonly source: string | null;
  /** Where the value that the file gives is written. */
  readonly at: string | null;
  /** What the launch file gives; missing where that is not known. */
  readonly file_value?: ParameterValue;
}

export interface Fault {
  /** The parts of the parameter's name. */
  readonly path: readonly string[];
  readonly message: string;
  readonly fix: string | null;
}

export interface ParametersSet {
  readonly changed: readonly { readonly name: string; readonly old: ParameterValue; readonly new: ParameterValue }[];
  readonly faults: readonly Fault[];
}

/** Edit of the launch file, made or only shown. */
export interface FileEdit {
  readonly file: string;
  /** Unified diff. */
  readonly edit: string;
  readonly saved: boolean;
}

export interface Run {
  readonly name: string;
  readonly file?: string | null;
  readonly since_ns?: number;
  readonly seed?: number | null;
  readonly clock?: string;
  readonly version?: string;
  /** How long it has not answered; missing while it does. */
  readonly silent_s?: number;
  /** Present once it has ended. */
  readonly ended?: EndedRun;
}

/** What is known of the end from outside: its exit code and report are the run's own. */
export interface EndedRun {
  readonly elapsed_s?: number | null;
  /** Whether it died without an end of its own, as by `kill -9`. */
  readonly was_killed?: boolean;
  /** The errors that its log had in the last seconds, oldest first. */
  readonly errors?: readonly string[];
  /** How long before the end the graph was seen last. */
  readonly seen_s?: number;
  /** Why another server cannot be reached. */
  readonly reason?: string;
}

/** Stamps are digits: as numbers they would lose their nanoseconds. */
export interface RecordingTime {
  readonly start_ns: string;
  readonly end_ns: string;
  readonly stamp_ns: string;
  readonly playing: boolean;
  readonly rate: number;
}

/** One number over a stretch of a recording. */
export interface OverviewRequest {
  readonly topic: string;
  readonly path: readonly (string | number | { readonly named: string })[];
  readonly from_ns: string;
  readonly to_ns: string;
  readonly bins: number;
}

export interface Overview {
  readonly from_ns: string;
  /** Seconds from `from_ns` on, sorted. */
  readonly times_s: readonly number[];
  /** The least and the greatest of each bin; null is a gap. */
  readonly values: readonly (number | null)[];
  /** Above 1 where only each so many messages were read. */
  readonly every: number;
}

export interface Recorded {
  readonly on: boolean;
  readonly path?: string | null;
  readonly messages?: number | null;
}

/** What answers questions about the text. */
export interface AssistantState {
  readonly running: boolean;
  /** Whether it is there, and has not said yet where questions go. */
  readonly starting?: boolean;
  readonly pages?: number;
  readonly engine?: string;
  /** The host that questions are sent to; empty where nothing leaves the machine. */
  readonly host?: string;
  readonly model?: string;
}

/** A verbatim part of a page; the place counts characters of its Markdown, or of the selection where there is no page. */
export interface Citation {
  readonly page: string;
  /** The book's page; empty where the book has none. */
  readonly chapter?: string;
  /** -1 where the text no longer stands there. */
  readonly start: number;
  readonly end: number;
  readonly text: string;
}

export interface AssistantAnswer {
  readonly answer: string;
  readonly answered: boolean;
  readonly scope: string;
  readonly reason: string;
  readonly citations: readonly Citation[];
  readonly engine: string;
  readonly ms: number;
}

/** A message type in the protocol's words. */
export interface WrittenForm {
  readonly schemaName: string;
  readonly encoding: string;
  readonly schema: string;
  readonly schemaEncoding: string;
}

/** What a goal and a result of an action are. */
export interface ActionTypes {
  readonly type: string;
  readonly goal: WrittenForm;
  readonly result: WrittenForm;
}

/** The end of a goal. */
export interface GoalEnd {
  /** ROS 2's number. */
  readonly state: number;
  /** Encoded, in base64. */
  readonly result: string;
  /** Why it did not succeed; empty where its server does not say. */
  readonly reason: string;
}

/** What each question takes and is answered with. */
export interface QuestionTable {
  graph: { arguments: Record<string, never>; answer: Graph };
  log: { arguments: { count?: number }; answer: { readonly lines: readonly LogLine[] } };
  health: { arguments: Record<string, never>; answer: { readonly findings: readonly Finding[] } };
  parameters: { arguments: { node: string }; answer: { readonly parameters: readonly Parameter[] } };
  set_parameters: {
    arguments: { node: string; values: Readonly<Record<string, ParameterValue>> };
    answer: ParametersSet;
  };
  save_parameters: { arguments: { nodes?: readonly string[]; dry_run: boolean }; answer: FileEdit };
  order: { arguments: { node: string; order: "start" | "stop" | "restart" }; answer: { readonly state: string } };
  log_level: { arguments: { node: string; level: string }; answer: Record<string, never> };
  action: { arguments: { action: string }; answer: ActionTypes };
  /** The goal is encoded, in base64; `{id}` comes before the answer, when it is accepted. */
  send_goal: { arguments: { action: string; goal: string; limit_s: number | null }; answer: GoalEnd };
  /** All goals where none is named. */
  cancel_goal: { arguments: { action: string; id?: string }; answer: { readonly canceling: readonly string[] } };
  record: { arguments: { on?: boolean }; answer: Recorded };
  seek: { arguments: { stamp_ns?: string; play?: boolean; rate?: number }; answer: { readonly stamp_ns: string } };
  overview: { arguments: OverviewRequest; answer: Overview };
  run: { arguments: Record<string, never>; answer: Run };
  /** What the launch file holds under `x-ui:`; null where it holds nothing. */
  layout: { arguments: Record<string, never>; answer: { readonly layout: unknown } };
  save_layout: { arguments: { layout: object; dry_run: boolean }; answer: FileEdit };
  assistant: { arguments: Record<string, never>; answer: AssistantState };
  ask_assistant: { arguments: { question: string; selection: string; chapter: string }; answer: AssistantAnswer };
  time: { arguments: Record<string, never>; answer: RecordingTime };
}

export type Question = keyof QuestionTable;

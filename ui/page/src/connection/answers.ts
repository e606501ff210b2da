/** The answers to busflow's own questions, in the words of the server. */

export interface Qos {
  readonly reliability: string;
  readonly durability: string;
  readonly history?: string;
  readonly depth?: number | null;
  readonly deadline_ns?: number | null;
  readonly lifespan_ns?: number | null;
  readonly liveliness?: string;
  readonly lease_ns?: number | null;
}

export interface Timer {
  readonly name: string;
  readonly period_s: number;
  readonly fired: number;
  readonly missed: number;
  readonly late_p50_s: number | null;
  readonly late_p99_s: number | null;
}

export interface GraphNode {
  readonly name: string;
  readonly process: string;
  readonly machine?: string | null;
  readonly namespace: string;
  readonly state: string;
  readonly plugin: string | null;
  /** Where its class is written, `file:line`. */
  readonly source: string | null;
  readonly restarts: number;
  readonly failures: readonly string[];
  readonly stopped_by_hand: boolean | number;
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
  readonly published: number;
  /** The declaration that publishes, such as `SensorPublisher.imu`. */
  readonly origin: string | null;
}

export interface TopicSubscription {
  readonly node: string;
  readonly qos: Qos;
  readonly published?: number;
  readonly delivered: number;
  readonly dropped: number;
  readonly queued: number;
  readonly origin: string | null;
  readonly reasons?: Readonly<Record<string, number>>;
}

export interface GraphTopic {
  readonly name: string;
  readonly type: string;
  readonly hidden: boolean;
  readonly published: number;
  readonly rate_hz: number | null;
  readonly publishers: readonly TopicPublisher[];
  readonly subscriptions: readonly TopicSubscription[];
  readonly losses: Readonly<Record<string, number>>;
}

export interface ServiceEnd {
  readonly node: string;
}

export interface GraphService {
  readonly name: string;
  readonly type: string;
  readonly hidden: boolean;
  readonly servers: readonly ServiceEnd[];
  readonly clients: readonly ServiceEnd[];
}

export interface Graph {
  readonly elapsed_s: number;
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
  readonly what: string;
  readonly fix: string | null;
  readonly where?: string | null;
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
  readonly ros_type: string;
  readonly value: ParameterValue;
  readonly default: ParameterValue;
  readonly required: boolean;
  readonly bounds: Bounds | null;
  /** The bounds in words. */
  readonly range: string | null;
  readonly choices: readonly ParameterValue[] | null;
  readonly description: string | null;
  readonly read_only: boolean;
  /** Where the value came from: a place in a file, or a word such as `default`. */
  readonly source: string | null;
  /** Where the value that the file gives is written. */
  readonly at: string | null;
}

export interface Fault {
  /** Parameter's name. */
  readonly path: string;
  readonly message: string;
  readonly fix: string | null;
}

export interface ParametersSet {
  readonly changed: readonly { readonly name: string; readonly old: ParameterValue; readonly new: ParameterValue }[];
  readonly faults: readonly Fault[];
}

export interface ParametersSaved {
  readonly file: string;
  /** Unified diff. */
  readonly edit: string;
  readonly saved: boolean;
}

export interface Run {
  readonly name: string;
  readonly file: string | null;
  readonly since_ns: number;
  readonly seed: number | null;
  readonly clock: string;
  readonly elapsed_s: number;
  readonly ended?: { readonly exit_code: number | null; readonly report: string } | null;
}

export interface RecordingTime {
  readonly start_ns: number;
  readonly end_ns: number;
  readonly stamp_ns: number;
  readonly playing: boolean;
  readonly rate: number;
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
  save_parameters: { arguments: { nodes?: readonly string[]; dry_run: boolean }; answer: ParametersSaved };
  order: { arguments: { node: string; order: "start" | "stop" | "restart" }; answer: { readonly state: string } };
  log_level: { arguments: { node: string; level: string }; answer: Record<string, never> };
  record: {
    arguments: { on: boolean };
    answer: { readonly on: boolean; readonly path?: string | null; readonly messages?: number | null };
  };
  seek: { arguments: { stamp_ns: number; play?: boolean; rate?: number }; answer: { readonly stamp_ns: number } };
  run: { arguments: Record<string, never>; answer: Run };
  layout: { arguments: { save?: object }; answer: { readonly layout: unknown } };
  time: { arguments: Record<string, never>; answer: RecordingTime };
}

export type Question = keyof QuestionTable;

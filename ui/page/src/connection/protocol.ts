/** The Foxglove WebSocket protocol as this page speaks it, and busflow's questions: frames read and written. No socket. */

import type { ParameterValue } from "./answers";

export const SUBPROTOCOLS = ["foxglove.sdk.v1", "foxglove.websocket.v1"];
/** Close code with which the server refuses a wrong token. */
export const REFUSED_CODE = 4401;

export interface ServerInfo {
  readonly name: string;
  readonly capabilities: readonly string[];
  readonly supportedEncodings?: readonly string[];
  readonly metadata?: Readonly<Record<string, string>>;
  readonly sessionId?: string;
}

/** Topic that can be subscribed to, with the definition of its type. */
export interface Channel {
  readonly id: number;
  readonly topic: string;
  readonly encoding: string;
  readonly schemaName: string;
  readonly schema: string;
  readonly schemaEncoding?: string;
}

export interface ServicePart {
  readonly encoding: string;
  readonly schemaName: string;
  readonly schema: string;
  readonly schemaEncoding: string;
}

export interface OfferedService {
  readonly id: number;
  readonly name: string;
  readonly type: string;
  readonly request?: ServicePart;
  readonly response?: ServicePart;
}

/** Parameter with its node's name before the first dot; without a value where it has none. */
export interface ParameterRow {
  readonly name: string;
  readonly value?: ParameterValue;
  /** `float64`, `float64_array` or `byte_array`, which the value does not show. */
  readonly type?: string;
}

/** Text frame of this page: what it asks the server to do. */
export interface Operation {
  readonly op: string;
  readonly [field: string]: unknown;
}

export type StatusLevel = 0 | 1 | 2;

/** What has changed in the graph: the nodes of each named topic or service, and names that have gone. */
export interface ConnectionGraphUpdate {
  readonly publishedTopics?: readonly { readonly name: string; readonly publisherIds: readonly string[] }[];
  readonly subscribedTopics?: readonly { readonly name: string; readonly subscriberIds: readonly string[] }[];
  readonly advertisedServices?: readonly { readonly name: string; readonly providerIds: readonly string[] }[];
  readonly removedTopics?: readonly string[];
  readonly removedServices?: readonly string[];
}

export type TextMessage =
  | ({ readonly op: "connectionGraphUpdate" } & ConnectionGraphUpdate)
  | ({ readonly op: "serverInfo" } & ServerInfo)
  | { readonly op: "status"; readonly level: StatusLevel; readonly message: string; readonly id?: string }
  | { readonly op: "removeStatus"; readonly statusIds: readonly string[] }
  | { readonly op: "advertise"; readonly channels: readonly Channel[] }
  | { readonly op: "unadvertise"; readonly channelIds: readonly number[] }
  | { readonly op: "advertiseServices"; readonly services: readonly OfferedService[] }
  | { readonly op: "unadvertiseServices"; readonly serviceIds: readonly number[] }
  | {
      readonly op: "serviceCallFailure";
      readonly serviceId: number;
      readonly callId: number;
      readonly message: string;
    }
  | { readonly op: "parameterValues"; readonly parameters: readonly ParameterRow[]; readonly id?: string }
  | { readonly op: "busflow/answer"; readonly id: number; readonly answer?: unknown; readonly error?: string }
  | { readonly op: "busflow/part"; readonly id: number; readonly part: unknown }
  | { readonly op: "busflow/update"; readonly question: string; readonly answer: unknown };

export interface MessageData {
  readonly op: "messageData";
  readonly subscription: number;
  readonly stampNs: bigint;
  readonly data: DataView;
}

export interface CallAnswered {
  readonly op: "callAnswered";
  readonly service: number;
  readonly call: number;
  readonly encoding: string;
  readonly data: DataView;
}

export type ServerMessage =
  TextMessage | MessageData | CallAnswered | { readonly op: "time"; readonly nowNs: bigint };

const MESSAGE_DATA = 1;
const TIME = 2;
const CALL_ANSWERED = 3;
const CLIENT_MESSAGE = 1;
const CLIENT_CALL = 2;

/** Returns what a frame says, or null for one of a kind that this page does not use. */
export function readFrame(frame: string | ArrayBuffer): ServerMessage | null {
  if (typeof frame === "string") return readText(frame);
  const view = new DataView(frame);
  if (view.byteLength < 9) return null;
  switch (view.getUint8(0)) {
    case MESSAGE_DATA:
      return view.byteLength < 13
        ? null
        : {
            op: "messageData",
            subscription: view.getUint32(1, true),
            stampNs: view.getBigUint64(5, true),
            data: new DataView(frame, 13),
          };
    case TIME:
      return { op: "time", nowNs: view.getBigUint64(1, true) };
    case CALL_ANSWERED:
      return readCallAnswered(frame, view);
    default:
      return null;
  }
}

function readText(frame: string): TextMessage | null {
  const message: unknown = JSON.parse(frame);
  const isMessage = typeof message === "object" && message !== null && "op" in message;
  // The server is this page's own origin: its fields are what the protocol says.
  return isMessage ? (message as TextMessage) : null;
}

function readCallAnswered(frame: ArrayBuffer, view: DataView): CallAnswered | null {
  if (view.byteLength < 13) return null;
  const length = view.getUint32(9, true);
  if (13 + length > view.byteLength) return null;
  return {
    op: "callAnswered",
    service: view.getUint32(1, true),
    call: view.getUint32(5, true),
    encoding: new TextDecoder().decode(new Uint8Array(frame, 13, length)),
    data: new DataView(frame, 13 + length),
  };
}

/** Returns the frame of a message that this page publishes. */
export function messageFrame(channel: number, payload: Uint8Array): Uint8Array<ArrayBuffer> {
  const frame = new Uint8Array(5 + payload.byteLength);
  const view = new DataView(frame.buffer);
  view.setUint8(0, CLIENT_MESSAGE);
  view.setUint32(1, channel, true);
  frame.set(payload, 5);
  return frame;
}

/** Returns the frame of a request to a service. */
export function callFrame(service: number, call: number, encoding: string, payload: Uint8Array): Uint8Array<ArrayBuffer> {
  const word = new TextEncoder().encode(encoding);
  const frame = new Uint8Array(13 + word.byteLength + payload.byteLength);
  const view = new DataView(frame.buffer);
  view.setUint8(0, CLIENT_CALL);
  view.setUint32(1, service, true);
  view.setUint32(5, call, true);
  view.setUint32(9, word.byteLength, true);
  frame.set(word, 13);
  frame.set(payload, 13 + word.byteLength);
  return frame;
}

/** Decoding of messages, as CDR or JSON, by the schema of their channel. */

import type { MessageDefinition } from "@foxglove/message-definition";
import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";

import type { Channel } from "../connection/protocol";
import { errorText } from "../store/text";
import { parseJson } from "./json";
import { shapeOfDefinitions, shapeOfJsonSchema, type Shape } from "./shapes";

/** Decoder of one channel's messages. */
export interface Decoder {
  readonly shape: Shape;
  /** Returns the message; throws an Error whose message is a sentence. */
  decode(data: DataView): unknown;
}

/** Returns the decoder of a channel; throws an Error that says why its messages cannot be read. */
export function decoderOf(channel: Channel): Decoder {
  if (channel.encoding === "cdr" && channel.schemaEncoding === "ros2msg") return cdrDecoder(channel);
  if (channel.encoding === "json") return jsonDecoder(channel);
  throw new Error(
    `${channel.topic} is encoded as ${channel.encoding} with a ${channel.schemaEncoding ?? "missing"} schema; ` +
      "this page reads cdr with ros2msg, and json",
  );
}

function cdrDecoder(channel: Channel): Decoder {
  const definitions = read(channel.topic, "the definition", () => definitionsOf(channel.schema));
  const reader = read(channel.topic, "the definition", () => new MessageReader(definitions));
  return {
    shape: shapeOfDefinitions(channel.schemaName.replace("/msg/", "/"), definitions),
    decode: (data) => read(channel.topic, "a message", () => reader.readMessage(data)),
  };
}

/** Returns the definitions in a text of ROS 2. */
export function definitionsOf(schema: string): MessageDefinition[] {
  return parse(schema, { ros2: true });
}

function jsonDecoder(channel: Channel): Decoder {
  const schema = channel.schema === "" ? {} : read(channel.topic, "the schema", () => JSON.parse(channel.schema) as unknown);
  const text = new TextDecoder("utf-8", { fatal: true });
  return {
    shape: shapeOfJsonSchema(schema),
    decode: (data) => read(channel.topic, "a message", () => parseJson(text.decode(data))),
  };
}

function read<Result>(topic: string, what: string, reading: () => Result): Result {
  try {
    return reading();
  } catch (error) {
    throw new Error(`${what} of ${topic} cannot be read: ${errorText(error)}`, { cause: error });
  }
}

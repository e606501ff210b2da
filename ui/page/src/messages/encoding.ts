/** Encoding of messages, as CDR or JSON, by the schema of a service's request or of a topic. */

import { MessageWriter } from "@foxglove/rosmsg2-serialization";

import { definitionsOf } from "./decoding";
import { jsonText } from "./json";
import { shapeOfDefinitions, shapeOfJsonSchema, type Shape } from "./shapes";

/** What is known of the type of a message that is to be written. */
export interface Written {
  readonly encoding: string;
  readonly schemaName: string;
  readonly schema: string;
}

export interface Encoder {
  readonly shape: Shape;
  /** Returns the bytes; fields that are left out become 0, empty or false. */
  encode(message: unknown): Uint8Array;
}

/** Returns the encoder of a type; throws an Error that says why nothing can be written. */
export function encoderOf(written: Written): Encoder {
  if (written.encoding === "json") {
    const shape = shapeOfJsonSchema(written.schema === "" ? {} : (JSON.parse(written.schema) as unknown));
    return { shape, encode: (message) => new TextEncoder().encode(jsonText(message)) };
  }
  if (written.encoding !== "cdr") throw new Error(`${written.schemaName} is encoded as ${written.encoding}; this page writes cdr and json`);
  const definitions = definitionsOf(written.schema);
  const writer = new MessageWriter(definitions);
  return {
    shape: shapeOfDefinitions(written.schemaName, definitions),
    encode: (message) => writer.writeMessage(padded(message)),
  };
}

/**
 * Returns a message whose texts have as many UTF-16 units as they have bytes.
 *
 * The writer takes the first number for the second and would cut `grün`; the zeros at the end are never written.
 */
export function padded(value: unknown): unknown {
  if (typeof value === "string") return value + "\0".repeat(new TextEncoder().encode(value).length - value.length);
  if (Array.isArray(value)) return value.map(padded);
  if (typeof value !== "object" || value === null || ArrayBuffer.isView(value)) return value;
  return Object.fromEntries(Object.entries(value).map(([key, each]) => [key, padded(each)]));
}

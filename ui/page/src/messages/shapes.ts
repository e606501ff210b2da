/** Shapes: the fields of a message type, with their types and units, from the schema of a topic. */

import type { MessageDefinition } from "@foxglove/message-definition";

import { isArray, isRecord, namesOf, stepTo, type Path, type Step } from "./paths";

/** Kind of a value: a number, a text, or a message with its fields, and whether there are several. */
export interface Shape {
  /** `float64`, `string`, or the name of a message type; of a JSON Schema its `type`. */
  readonly type: string;
  readonly many: boolean;
  readonly fields: ReadonlyMap<string, Shape> | undefined;
  /** The default that the definition states; missing where it states none. */
  readonly usual?: unknown;
}

const NUMBERS = /^(u?int(8|16|32|64)|float(32|64)|bool|number|integer|boolean)$/;
const TIMES = new Set(["time", "duration"]);
const MOST_DEPTH = 16;
const MOST_ITEMS = 64;
const MOST_PATHS = 2000;
const MOST_FIELDS = 10_000;

/** Returns the shape of the first of parsed definitions. */
export function shapeOfDefinitions(type: string, definitions: readonly MessageDefinition[]): Shape {
  const known = new Map(definitions.map((each) => [each.name ?? type, each]));
  let fieldsLeft = MOST_FIELDS; // a few definitions that use each other twice could make it endless
  const shape = (name: string, many: boolean, depth: number): Shape => {
    fieldsLeft -= 1;
    if (TIMES.has(name)) return { type: name, many, fields: timeFields() };
    const definition = known.get(name);
    if (definition === undefined || depth > MOST_DEPTH || fieldsLeft < 0) return { type: name, many, fields: undefined };
    const fields = definition.definitions.filter((each) => each.isConstant !== true);
    return {
      type: name,
      many,
      fields: new Map(
        fields.map((each) => [each.name, withUsual(shape(each.type, each.isArray === true, depth + 1), each.defaultValue)]),
      ),
    };
  };
  return shape(definitions[0]?.name ?? type, false, 0);
}

function withUsual(shape: Shape, usual: unknown): Shape {
  return usual === undefined ? shape : { ...shape, usual };
}

function timeFields(): ReadonlyMap<string, Shape> {
  const part = (type: string): Shape => ({ type, many: false, fields: undefined });
  return new Map([
    ["sec", part("int32")],
    ["nanosec", part("uint32")],
  ]);
}

/** Returns the shape that a JSON Schema describes; what it leaves open is left open. */
export function shapeOfJsonSchema(schema: unknown, depth = 0): Shape {
  if (!isRecord(schema) || depth > MOST_DEPTH) return { type: "any", many: false, fields: undefined };
  if (schema.type === "array") return { ...shapeOfJsonSchema(schema.items, depth + 1), many: true };
  const type = typeof schema.type === "string" ? schema.type : "any";
  if (!isRecord(schema.properties)) return { type, many: false, fields: undefined };
  const rows = Object.entries(schema.properties).slice(0, MOST_PATHS);
  const fields = rows.map(([key, each]) => [key, withUsual(shapeOfJsonSchema(each, depth + 1), isRecord(each) ? each.default : undefined)] as const);
  return { type, many: false, fields: new Map(fields) };
}

/** Returns the number that a plot shows of a value; undefined if it is none. */
export function numberOf(value: unknown): number | undefined {
  switch (typeof value) {
    case "number":
      return value;
    case "bigint":
      return Number(value);
    case "boolean":
      return value ? 1 : 0;
    default:
      return undefined;
  }
}

/** Returns the paths of all numbers of a shape; of an array only its first item, as its length is not known. */
export function numbersOfShape(shape: Shape): Path[] {
  const found: Path[] = [];
  const walk = (each: Shape, path: Path): void => {
    if (found.length >= MOST_PATHS) return;
    const at = each.many ? [...path, 0] : path;
    if (each.fields !== undefined) for (const [key, inner] of each.fields) walk(inner, [...at, stepTo(key)]);
    else if (NUMBERS.test(each.type)) found.push(at);
  };
  walk(shape, []);
  return found;
}

/** Returns the paths of the numbers of a message; an array's items by the names that stand beside it, if any do. */
export function numbersOfMessage(message: unknown): Path[] {
  const found: Path[] = [];
  const walk = (value: unknown, path: Path, ancestors: readonly unknown[]): void => {
    if (found.length >= MOST_PATHS || path.length > MOST_DEPTH) return;
    if (numberOf(value) !== undefined) found.push(path);
    else if (isArray(value)) for (const [step, item] of itemsOf(value, ancestors)) walk(item, [...path, step], [...ancestors, value]);
    else if (isRecord(value)) for (const key of Object.keys(value)) walk(value[key], [...path, stepTo(key)], [...ancestors, value]);
  };
  walk(message, [], []);
  return found;
}

function* itemsOf(items: ArrayLike<unknown>, ancestors: readonly unknown[]): Iterable<[Step, unknown]> {
  const names = namesOf(items, ancestors);
  for (let at = 0; at < Math.min(items.length, MOST_ITEMS); at += 1) {
    const name = names?.[at];
    yield [name === undefined ? at : { named: name }, items[at]];
  }
}

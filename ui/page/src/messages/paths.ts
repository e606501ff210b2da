/**
 * Paths of fields in messages, as busflow's `--field` writes them: `linear_acceleration.z`, `position[0]`.
 *
 * The page knows one more step: `position[left_knee_joint]`, the item of an array beside an array of names. It stays
 * with its joint when the order of the joints changes. What is no plain word stands in quotes: `values["left knee"]`.
 */

/** Item of an array by the name that stands beside it, or the value of an odd key. */
export interface Named {
  readonly named: string;
}

export type Step = string | number | Named;
export type Path = readonly Step[];

/** Field of a topic's messages, which a plot shows as one line. */
export interface Address {
  readonly topic: string;
  readonly path: Path;
}

/** Error for text that is no path; `at` is where. */
export class PathError extends Error {
  constructor(
    message: string,
    readonly at: number,
  ) {
    super(message);
  }
}

const STEP = /([A-Za-z_]\w*)|\[\s*(?:(-?\d{1,9})|([A-Za-z_][\w./-]*)|("(?:[^"\\]|\\.)*"))\s*\]/y;
const WORD = /^[A-Za-z_][\w./-]*$/;
const FIELD = /^[A-Za-z_]\w*$/;
const MOST_LENGTH = 1000;
/** Fields that name the items of the arrays beside them. */
export const NAMES = ["name", "names", "joint_names"];
/** Fields by which an item names itself: a transform is that of its child. */
const OWN_NAMES = ["name", "child_frame_id"];

/** Parses the path of a field; throws a PathError. */
export function parsePath(text: string): Path {
  const steps: Step[] = [];
  let at = 0;
  if (text.length > MOST_LENGTH) throw new PathError(`a path has at most ${MOST_LENGTH} characters`, MOST_LENGTH);
  while (at < text.length) {
    if (steps.length > 0 && text[at] === ".") at += 1;
    STEP.lastIndex = at;
    const found = STEP.exec(text);
    // A field follows a dot, what stands in brackets follows a field or other brackets; either may begin.
    const isField = found?.[1] !== undefined;
    if (found === null || (steps.length > 0 && isField !== (text[at - 1] === "."))) {
      throw new PathError("a path is field.field or field[0].field", at);
    }
    steps.push(stepOf(found, at));
    at = STEP.lastIndex;
  }
  if (steps.length === 0) throw new PathError("a field is missing", at);
  return steps;
}

function stepOf([, field, index, word, quoted]: RegExpExecArray, at: number): Step {
  if (field !== undefined) return field;
  if (index !== undefined) return Number(index);
  if (word !== undefined) return { named: word };
  try {
    return { named: String(JSON.parse(quoted ?? "")) };
  } catch {
    throw new PathError("the text in quotes is no JSON string", at);
  }
}

/** Parses `imu/data.linear_acceleration.y`: a topic, with or without its first slash, and the path in its messages. */
export function parseAddress(text: string): Address {
  const trimmed = text.trim();
  const end = trimmed.search(/[.[]/);
  if (end <= 0) throw new PathError("a line is topic.field, such as imu/data.linear_acceleration.y", trimmed.length);
  const topic = trimmed.slice(0, end);
  try {
    const path = parsePath(trimmed.slice(trimmed[end] === "." ? end + 1 : end));
    return { topic: topic.startsWith("/") ? topic : `/${topic}`, path };
  } catch (error) {
    throw error instanceof PathError ? new PathError(error.message, error.at + end + 1) : error;
  }
}

/** Returns the text of a path. */
export function pathText(path: Path): string {
  return path.map((step, at) => (typeof step === "string" ? (at === 0 ? step : `.${step}`) : `[${itemText(step)}]`)).join("");
}

function itemText(step: number | Named): string {
  if (typeof step === "number") return String(step);
  return WORD.test(step.named) ? step.named : JSON.stringify(step.named);
}

/** Returns the text of an address, without the topic's first slash. */
export function addressText({ topic, path }: Address): string {
  const text = pathText(path);
  return `${topic.replace(/^\//, "")}${text.startsWith("[") ? "" : "."}${text}`;
}

/** Returns the step to a field of an object; a key that is no field of a ROS message is named. */
export function stepTo(key: string): Step {
  return FIELD.test(key) ? key : { named: key };
}

/** Returns the value at a path of a message; undefined where the message has none. */
export function valueAt(path: Path, message: unknown): unknown {
  const ancestors: unknown[] = [];
  let value = message;
  for (const step of path) {
    const parent = value;
    if (typeof step === "number") value = isArray(value) ? value[step < 0 ? value.length + step : step] : undefined;
    else if (typeof step === "string") value = field(value, step);
    else value = isArray(value) ? value[indexNamed(step.named, value, ancestors)] : field(value, step.named);
    if (value === undefined) return undefined;
    ancestors.push(parent);
  }
  return value;
}

/** Returns the names of an array's items: of an array of names beside it or above it, or of the items themselves. */
export function namesOf(items: ArrayLike<unknown>, ancestors: readonly unknown[]): readonly string[] | undefined {
  if (items.length === 0) return undefined;
  for (let at = ancestors.length - 1; at >= 0; at -= 1) {
    for (const word of NAMES) {
      const names = field(ancestors[at], word);
      if (names !== items && areTexts(names) && names.length === items.length) return names;
    }
  }
  if (!Array.isArray(items)) return undefined;
  return OWN_NAMES.map((word) => items.map((item) => field(item, word))).find((own): own is string[] => areTexts(own));
}

function indexNamed(name: string, items: ArrayLike<unknown>, ancestors: readonly unknown[]): number {
  return namesOf(items, ancestors)?.indexOf(name) ?? -1;
}

function areTexts(values: unknown): values is readonly string[] {
  return Array.isArray(values) && values.every((each) => typeof each === "string" && each !== "");
}

function field(value: unknown, key: string): unknown {
  return isRecord(value) && Object.hasOwn(value, key) ? value[key] : undefined;
}

/** Whether a value is an array, plain or typed. */
export function isArray(value: unknown): value is ArrayLike<unknown> {
  return Array.isArray(value) || (ArrayBuffer.isView(value) && !(value instanceof DataView));
}

/** Whether a value is an object with fields. */
export function isRecord(value: unknown): value is Readonly<Record<string, unknown>> {
  return typeof value === "object" && value !== null && !isArray(value);
}

/** The form of a request: the fields of its type, and the message that their texts make. Pure. */
import type { Shape } from "../messages/shapes";
import { errorText } from "../store/text";

export type InputKind = "switch" | "integer" | "number" | "text" | "json";

/** One field of the form; a nested one has the names of those around it before its own. */
export interface RequestField {
  readonly path: readonly string[];
  readonly kind: InputKind;
  /** The type as it is declared, such as `float64` or `string[]`. */
  readonly type: string;
  /** The default of the type, where its definition states one. */
  readonly usual?: unknown;
}

const INTEGERS = /^(u?int(8|16|32|64)|byte|char|integer)$/;
const FLOATS = /^(float(32|64)|number)$/;
const BOOLEANS = /^bool(ean)?$/;
const MOST_FIELDS = 200;
/** Field of types without any; ROS 2 puts it into their encoding. */
export const PLACEHOLDER = "structure_needs_at_least_one_member";

/** Returns the fields of a request's type, from top to bottom. */
export function requestFields(shape: Shape): readonly RequestField[] {
  const found: RequestField[] = [];
  const walk = (each: Shape, path: readonly string[]): void => {
    if (found.length >= MOST_FIELDS || path.at(-1) === PLACEHOLDER) return;
    if (each.fields !== undefined && !each.many) for (const [name, inner] of each.fields) walk(inner, [...path, name]);
    else if (path.length > 0) {
      const usual = each.usual === undefined ? {} : { usual: each.usual };
      found.push({ path, kind: kindOf(each), type: `${each.type}${each.many ? "[]" : ""}`, ...usual });
    }
  };
  walk(shape, []);
  return found;
}

function kindOf({ type, many }: Shape): InputKind {
  if (many) return "json";
  if (BOOLEANS.test(type)) return "switch";
  if (INTEGERS.test(type)) return "integer";
  if (FLOATS.test(type)) return "number";
  return /^w?string$/.test(type) ? "text" : "json";
}

export type Built =
  { readonly message: Record<string, unknown> } | { readonly errors: ReadonlyMap<string, string> };

/** Returns the message that the texts make, by the dotted paths of their fields; empty ones have their defaults, or are left out. */
export function requestOf(fields: readonly RequestField[], texts: ReadonlyMap<string, string>): Built {
  const errors = new Map<string, string>();
  const message: Record<string, unknown> = {};
  for (const field of fields) {
    const key = field.path.join(".");
    const text = texts.get(key) ?? "";
    if (text === "") {
      if (field.usual !== undefined) put(message, field.path, field.usual);
      continue;
    }
    try {
      put(message, field.path, valueOf(text, field.kind));
    } catch (error) {
      errors.set(key, errorText(error));
    }
  }
  return errors.size > 0 ? { errors } : { message };
}

function valueOf(text: string, kind: InputKind): unknown {
  switch (kind) {
    case "switch":
      return text === "true";
    case "text":
      return text;
    case "integer":
      if (!/^\s*[-+]?\d+\s*$/.test(text)) throw new Error(`${text} is no whole number.`);
      return Number.isSafeInteger(Number(text)) ? Number(text) : BigInt(text.trim());
    case "number":
      return numberOf(text);
    case "json":
      try {
        return JSON.parse(text) as unknown;
      } catch {
        throw new Error("Write it as JSON, such as [1, 2.5].");
      }
  }
}

function numberOf(text: string): number {
  const special = /^\s*([-+]?)(\.?inf|\.?nan)\s*$/i.exec(text);
  if (special !== null) return special[2]?.toLowerCase().endsWith("nan") === true ? NaN : special[1] === "-" ? -Infinity : Infinity;
  if (text.trim() === "" || Number.isNaN(Number(text))) throw new Error(`${text} is no number.`);
  return Number(text);
}

function put(message: Record<string, unknown>, path: readonly string[], value: unknown): void {
  const [name, ...rest] = path;
  if (name === undefined) return;
  if (rest.length === 0) {
    message[name] = value;
    return;
  }
  const inner = (message[name] ?? {}) as Record<string, unknown>;
  message[name] = inner;
  put(inner, rest, value);
}

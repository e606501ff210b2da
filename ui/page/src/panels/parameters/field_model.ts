/** What kind of control a parameter has, and how its text becomes a value. Pure. */
import type { Parameter, ParameterValue } from "../../connection/answers";

export type FieldKind = "slider" | "number" | "switch" | "choice" | "text" | "json";

export interface Field {
  readonly parameter: Parameter;
  readonly kind: FieldKind;
  readonly isInteger: boolean;
  readonly unit: string;
  /** The description without the unit. */
  readonly description: string;
  /** Limits of a slider. */
  readonly minimum: number;
  readonly maximum: number;
  readonly step: number;
}

/** Number of positions of a slider of floats, where the declaration states no step. */
const POSITIONS = 200;
/** The last words of a description, such as `, rad.` or `, m/s.` */
const UNIT = /, ([^\s,.]{1,8})\.?$/;

export function fieldOf(parameter: Parameter): Field {
  const isInteger = /^int\b/.test(parameter.type);
  const { minimum, maximum } = parameter.bounds ?? {};
  const hasRange = typeof minimum === "number" && typeof maximum === "number" && maximum > minimum;
  const unit = parameter.unit ?? UNIT.exec(parameter.description ?? "")?.[1] ?? "";
  return {
    parameter,
    kind: kindOf(parameter, hasRange),
    isInteger,
    unit,
    description: (parameter.description ?? "").replace(UNIT, "."),
    minimum: hasRange ? minimum : 0,
    maximum: hasRange ? maximum : 0,
    step: parameter.bounds?.step ?? (isInteger ? 1 : hasRange ? niceStep((maximum - minimum) / POSITIONS) : 0),
  };
}

function kindOf({ choices, type, value, default: usual }: Parameter, hasRange: boolean): FieldKind {
  if (choices !== null && choices.length > 0) return "choice";
  if (/^bool\b/.test(type)) return "switch";
  if (/^(int|float)\b/.test(type)) return hasRange ? "slider" : "number";
  const example = value ?? usual;
  if (/^str\b/.test(type) || (typeof example === "string" && !/^(list|tuple|dict)/.test(type))) return "text";
  return "json";
}

/** Returns the largest of 1, 2 or 5 times a power of ten that is not above a step. */
export function niceStep(step: number): number {
  const power = 10 ** Math.floor(Math.log10(step));
  const nice = [5, 2, 1].find((factor) => factor * power <= step * (1 + 1e-9)) ?? 1;
  return Number((nice * power).toPrecision(1));
}

/** Returns a value as it is typed: floats keep a point, so that 5.0 does not look like an integer. */
export function textOf(value: ParameterValue, field: Pick<Field, "kind" | "parameter">): string {
  if (value === null) return "";
  if (typeof value === "number" && field.parameter.type.startsWith("float")) {
    return Number.isInteger(value) && Math.abs(value) < 1e15 ? value.toFixed(1) : String(value);
  }
  return typeof value === "string" ? value : JSON.stringify(value);
}

export type Read = { readonly value: ParameterValue } | { readonly error: string };

/** Reads what was typed; whether the value is allowed is for the run to say. */
export function readText(text: string, field: Field): Read {
  const typed = text.trim();
  switch (field.kind) {
    case "slider":
    case "number":
      return readNumber(typed, field);
    case "text":
      return { value: text };
    case "switch":
      return { value: typed === "true" };
    case "choice":
      return { value: field.parameter.choices?.find((choice) => textOf(choice, field) === text) ?? null };
    case "json":
      return readJson(typed);
  }
}

function readNumber(typed: string, { isInteger, parameter }: Field): Read {
  if (typed === "" && !parameter.required && parameter.default === null) return { value: null };
  if (/^[-+]?\.?(inf|nan)$/i.test(typed) && !isInteger) return { value: typed };
  const value = Number(typed);
  if (typed === "" || Number.isNaN(value)) return { error: `${typed === "" ? "Nothing" : typed} is no number.` };
  if (isInteger && !Number.isInteger(value)) return { error: `${typed} is no whole number.` };
  return { value };
}

function readJson(typed: string): Read {
  try {
    return { value: JSON.parse(typed) as ParameterValue };
  } catch {
    return { error: 'Write it as JSON, such as [1, 2.5] or ["a", "b"].' };
  }
}

/** Returns whether two values are the same, lists item by item; a field that is null is as one that is left out. */
export function isSame(one: ParameterValue | undefined, other: ParameterValue | undefined): boolean {
  const stated = (_: string, value: unknown): unknown => value ?? undefined;
  return JSON.stringify(one, stated) === JSON.stringify(other, stated);
}

/** How a value stands to the launch file: null where it is the file's own, or not known to differ. */
export function differenceOf(parameter: Parameter): string | null {
  const { file_value: inFile, value, source } = parameter;
  if (inFile !== undefined) {
    return isSame(inFile, value) ? null : `${textOf(inFile, { kind: "json", parameter }) || "nothing"} in the file`;
  }
  return source === "set at run time" ? "set at run time" : null;
}

/** Returns the message about a field among the faults of a refusal, with what to do. */
export function faultOf(
  faults: readonly { readonly path: readonly string[]; readonly message: string; readonly fix: string | null }[],
  name: string,
): string | null {
  const found = faults.find(({ path }) => path.join(".") === name) ?? faults[0];
  if (found === undefined) return null;
  return found.fix === null ? found.message : `${found.message} (${found.fix})`;
}

/** Groups the fields of a form by the first part of their dotted names; those without a dot come first. */
export function grouped(parameters: readonly Parameter[]): readonly (readonly [string, readonly Parameter[]])[] {
  const groups = new Map<string, Parameter[]>([["", []]]);
  for (const parameter of parameters) {
    const dot = parameter.name.lastIndexOf(".");
    const group = dot < 0 ? "" : parameter.name.slice(0, dot);
    groups.set(group, [...(groups.get(group) ?? []), parameter]);
  }
  return [...groups].filter(([, members]) => members.length > 0);
}

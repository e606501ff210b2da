/** An answer as lines of text, like YAML. Pure. */
import { isRecord } from "../messages/paths";
import { PLACEHOLDER } from "./request_model";

const MOST_ITEMS = 100;

export function answerLines(value: unknown, indent = ""): readonly string[] {
  if (!isRecord(value)) return [`${indent}${scalarText(value)}`];
  return Object.entries(value)
    .filter(([key]) => key !== PLACEHOLDER)
    .flatMap(([key, each]) => {
      if (isRecord(each)) return [`${indent}${key}:`, ...answerLines(each, `${indent}  `)];
      if (isList(each) && each.some(isRecord)) {
        const shown = each.slice(0, MOST_ITEMS).flatMap((item) => [`${indent}  -`, ...answerLines(item, `${indent}    `)]);
        return [`${indent}${key}:`, ...shown, ...(each.length > MOST_ITEMS ? [`${indent}  …`] : [])];
      }
      return [`${indent}${key}: ${scalarText(each)}`];
    });
}

function isList(value: unknown): value is readonly unknown[] {
  return Array.isArray(value);
}

function scalarText(value: unknown): string {
  if (typeof value === "string") return value.includes("\n") || value === "" ? JSON.stringify(value) : value;
  if (Array.isArray(value) || ArrayBuffer.isView(value)) {
    const items = [...(value as Iterable<unknown>)];
    const shown = items.slice(0, MOST_ITEMS).map(scalarText).join(", ");
    return `[${shown}${items.length > MOST_ITEMS ? `, … ${items.length} in all` : ""}]`;
  }
  return String(value);
}

/** CSV: the points of lines as a table, a row for each stamp. */

import { firstAfter, type Points } from "../messages/ring";
import type { Stretch } from "./timeline";

/** Line of a table, with its name and unit. */
export interface Column {
  readonly name: string;
  readonly unit: string | undefined;
  readonly points: Points;
}

/** Returns the table of a stretch of time; a line without a point at a stamp has an empty cell there. */
export function csvOf(columns: readonly Column[], { from, to }: Stretch, stampOf: (timeS: number) => bigint): string {
  const parts = columns.map(({ points: { times, values } }) => {
    const end = firstAfter(times, to);
    let at = firstAfter(times, from);
    while (at > 0 && times[at - 1] === from) at -= 1;
    return { times, values, at, end };
  });
  const rows = [["stamp_ns", ...columns.map(headOf)].map(cellOf).join(",")];
  for (;;) {
    let next = Infinity;
    for (const { times, at, end } of parts) if (at < end) next = Math.min(next, times[at] ?? Infinity);
    if (next === Infinity) return `${rows.join("\n")}\n`;
    const cells = parts.map((part) => {
      if (part.at >= part.end || part.times[part.at] !== next) return "";
      const value = part.values[part.at] ?? NaN;
      part.at += 1;
      return Number.isNaN(value) ? "" : String(value);
    });
    if (cells.some((cell) => cell !== "")) rows.push([String(stampOf(next)), ...cells].join(","));
  }
}

function headOf({ name, unit }: Column): string {
  return unit === undefined ? name : `${name} [${unit}]`;
}

/** Returns a cell that a spreadsheet takes for text, also where it looks like a formula. */
function cellOf(text: string): string {
  const plain = /^[=+\-@\t\r]/.test(text) ? `'${text}` : text;
  return /[",\n\r]/.test(plain) ? `"${plain.replaceAll('"', '""')}"` : plain;
}

/** Rows: a message as the lines of a tree, with long texts and arrays cut. */

import { isArray, isRecord, namesOf, pathText, stepTo, type Path, type Step } from "./paths";
import { matcher } from "../store/search";
import { numberOf } from "./shapes";
import { stampText, timeNs } from "./stamps";

/** One line of a tree. */
export interface Row {
  /** Path as text; it identifies the row. */
  readonly path: string;
  readonly depth: number;
  readonly name: string;
  readonly kind: "branch" | "number" | "text" | "rest";
  readonly text: string;
  /** Whether a branch shows what is in it. */
  readonly isOpen: boolean;
}

/** What of a tree is shown. */
export interface Shown {
  /** Paths of the branches that a person has opened or closed, against how they begin. */
  readonly toggled: ReadonlySet<string>;
  /** How many items of an array are shown, where it is not `FIRST_ITEMS`; by path. */
  readonly items: ReadonlyMap<string, number>;
  /** Words that must occur in the path or in the value; all branches are open then, and those without a match left out. */
  readonly search?: string;
}

export const FIRST_ITEMS = 20;
const MOST_ROWS = 2000;
const MOST_TEXT = 300;
const OPEN_DEPTH = 2;
const FEW_ITEMS = 12;
// What a terminal would obey, and what turns the direction of writing.
const CONTROL = /[\p{Cc}\u200e\u200f\u202a-\u202e\u2066-\u2069]/gu;

/** Returns the rows of a message. */
export function rowsOf(message: unknown, shown: Shown): readonly Row[] {
  const rows = allRows(message, shown);
  return isSearch(shown) ? found(rows, matcher(shown.search ?? "")) : rows;
}

/** Returns whether there are words to look for. */
export function isSearch({ search = "" }: Shown): boolean {
  return search.trim() !== "";
}

/** Returns the rows that match, below the branches in which they are. */
function found(rows: readonly Row[], matches: (text: string) => boolean): readonly Row[] {
  const kept: Row[] = [];
  let depth = 0; // of the row that was kept last, going backwards: what stands before it, less deep, is around it
  for (const row of rows.toReversed()) {
    if (row.depth >= depth && !matches(`${row.path} ${row.text}`)) continue;
    kept.push(row);
    ({ depth } = row);
  }
  return kept.reverse();
}

function allRows(message: unknown, shown: Shown): Row[] {
  const rows: Row[] = [];
  const isAllOpen = isSearch(shown);
  const add = (value: unknown, step: Step, path: Path, ancestors: readonly unknown[]): void => {
    if (rows.length >= MOST_ROWS) return;
    const text = pathText(path);
    const [name, depth] = [typeof step === "object" ? step.named : String(step), path.length];
    if (!isBranch(value)) {
      rows.push({ path: text, depth, name, kind: numberOf(value) === undefined ? "text" : "number", text: leafText(value), isOpen: false });
      return;
    }
    const isOpen = isAllOpen || beginsOpen(value, depth) !== shown.toggled.has(text);
    rows.push({ path: text, depth, name, kind: "branch", text: summaryOf(value), isOpen });
    if (isOpen) addInside(value, path, [...ancestors, value]);
  };
  const addInside = (value: object, path: Path, ancestors: readonly unknown[]): void => {
    if (!isArray(value)) {
      for (const [key, each] of Object.entries(value)) add(each, stepTo(key), [...path, stepTo(key)], ancestors);
      return;
    }
    const most = Math.min(value.length, shown.items.get(pathText(path)) ?? FIRST_ITEMS);
    const names = namesOf(value, ancestors.slice(0, -1));
    for (let at = 0; at < most; at += 1) {
      const name = names?.[at];
      const step = name === undefined ? at : { named: name };
      add(value[at], step, [...path, step], ancestors);
    }
    const rest = value.length - most;
    if (rest > 0) rows.push({ path: `${pathText(path)}[…]`, depth: path.length + 1, name: "…", kind: "rest", text: `${rest} more`, isOpen: false });
  };
  if (isBranch(message)) addInside(message, [], [message]);
  else add(message, "message", ["message"], []);
  return rows;
}

function isBranch(value: unknown): value is object {
  return isArray(value) || isRecord(value);
}

function beginsOpen(value: object, depth: number): boolean {
  return isArray(value) ? value.length <= FEW_ITEMS && depth < OPEN_DEPTH : depth < OPEN_DEPTH || Object.keys(value).length <= 4;
}

function summaryOf(value: object): string {
  if (isArray(value)) {
    const kind = ArrayBuffer.isView(value) ? value.constructor.name.replace("Array", "").toLowerCase() : typeof value[0];
    return value.length === 0 ? "empty" : `${value.length} × ${kind === "object" ? "message" : kind}`;
  }
  const stamp = timeNs(value);
  return stamp === undefined ? "" : stampText(stamp, 6);
}

/** Returns the text of a plain value; a control character, which could mislead, is shown by its number. */
export function leafText(value: unknown): string {
  switch (typeof value) {
    case "string":
      return (value.length > MOST_TEXT ? `${value.slice(0, MOST_TEXT)}…` : value).replace(CONTROL, numberOfCharacter);
    case "number":
      return Number.isInteger(value) || !Number.isFinite(value) ? String(value) : String(Number(value.toPrecision(9)));
    case "bigint":
    case "boolean":
      return String(value);
    default:
      return "null";
  }
}

function numberOfCharacter(character: string): string {
  return `\\u${character.charCodeAt(0).toString(16).padStart(4, "0")}`;
}

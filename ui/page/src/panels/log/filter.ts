/** The filter of the log. Pure. */
import type { LogLine } from "../../connection/answers";
import { matcher } from "../../store/search";

export interface LogFilter {
  /** The least level that is shown, as a number of ROS 2. */
  readonly level: number;
  /** Only the lines of this node; of all where it is empty. */
  readonly node: string;
  /** Words that must occur in the line or in its node's name. */
  readonly text: string;
}

export const LEVELS: readonly (readonly [number, string])[] = [
  [10, "debug"],
  [20, "info"],
  [30, "warning"],
  [40, "error"],
  [50, "critical"],
];

/** Returns a level's word. */
export function levelWord(level: number): string {
  return LEVELS.findLast(([number]) => level >= number)?.[1] ?? "debug";
}

export function filtered<Line extends LogLine>(lines: readonly Line[], filter: LogFilter): readonly Line[] {
  const matches = matcher(filter.text);
  return lines.filter(
    (line) =>
      line.level >= filter.level &&
      (filter.node === "" || line.node === filter.node) &&
      (filter.text === "" || matches(`${line.node} ${line.text}`)),
  );
}

/** Returns the names of the nodes that have logged, sorted. */
export function nodesOf(lines: readonly LogLine[]): readonly string[] {
  return [...new Set(lines.map(({ node }) => node))].sort();
}

/** Settings of a plot: the addresses of its lines. */

import type { Settings } from "../panels/panel";

const MOST_LINES = 50;

/** Returns the addresses of a plot's lines; settings come from an address, which anyone may write. */
export function linesOf(settings: Settings): readonly string[] {
  const { lines } = settings;
  if (!Array.isArray(lines)) return [];
  return [...new Set(lines.filter((each): each is string => typeof each === "string"))].slice(0, MOST_LINES);
}

/** Returns settings with one more line, where there is room for it. */
export function withLine(settings: Settings, address: string): Settings {
  return { ...settings, lines: [...new Set([...linesOf(settings), address])].slice(0, MOST_LINES) };
}

/** Returns the addresses of a topic's fields, which spaces separate; what is no path stays as it is, to be reported. */
export function linesOfField(topic: string, fields: string): readonly string[] {
  return fields.split(/\s+/).flatMap((field) => (field === "" ? [] : [`${topic}${field.startsWith("[") ? "" : "."}${field}`]));
}

export function withoutLine(settings: Settings, address: string): Settings {
  return { ...settings, lines: linesOf(settings).filter((each) => each !== address) };
}

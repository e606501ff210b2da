/** Settings: what the graph panel remembers. */
import type { Settings } from "../panel";
import type { Grouping } from "./model";

export interface GraphSettings {
  readonly grouping: Grouping | null;
  readonly services: boolean;
  readonly hidden: boolean;
  readonly selected: string | null;
  readonly search: string;
  /** Groups that are folded where they usually are not, or the other way round. */
  readonly toggled: readonly string[];
}

const GROUPINGS: readonly Grouping[] = ["none", "namespace", "process", "machine"];

export function readSettings(settings: Settings): GraphSettings {
  return {
    grouping: GROUPINGS.find((each) => each === settings.grouping) ?? null,
    services: settings.services === true,
    hidden: settings.hidden === true,
    selected: typeof settings.selected === "string" ? settings.selected : null,
    search: typeof settings.search === "string" ? settings.search : "",
    toggled: Array.isArray(settings.toggled) ? settings.toggled.filter((each): each is string => typeof each === "string") : [],
  };
}

/** Returns the settings to remember: those that differ from the usual ones. */
export function writeSettings(settings: GraphSettings): Settings {
  return Object.fromEntries(Object.entries(settings).filter(([, value]) => !isUsual(value)));
}

function isUsual(value: unknown): boolean {
  return value === null || value === false || value === "" || (Array.isArray(value) && value.length === 0);
}

/** Layout: which panels stand where, as the address holds it. Pure. */
import { isRecord } from "../messages/paths";
import type { Settings } from "../panels/panel";
import { withLine } from "../plots/settings";

/** Panel at its place. */
export interface Place {
  readonly kind: string;
  readonly settings: Settings;
}

/** Columns from left to right, each with its panels from top to bottom. */
export type Columns = readonly (readonly Place[])[];

/** Each kind of panel has a view of its own, to which others may be added beside it. */
export interface Layout {
  /** The kind whose view is shown. */
  readonly view: string;
  /** The views that differ from a single panel without settings. */
  readonly views: Readonly<Record<string, Columns>>;
}

const MOST_PANELS = 12;
const KEY = "layout=";

export function viewOf(layout: Layout, kind: string): Columns {
  return layout.views[kind] ?? [[{ kind, settings: {} }]];
}

export function shownIn(layout: Layout): Columns {
  return viewOf(layout, layout.view);
}

/** Returns the layout with other columns in the shown view; without any it shows its own panel alone. */
function withColumns(layout: Layout, columns: Columns): Layout {
  const kept = columns.filter((column) => column.length > 0);
  const others = Object.entries(layout.views).filter(([kind]) => kind !== layout.view);
  const own: [string, Columns][] = kept.length > 0 ? [[layout.view, kept]] : [];
  return { ...layout, views: Object.fromEntries([...others, ...own]) };
}

export function addPanel(layout: Layout, kind: string): Layout {
  const columns = shownIn(layout);
  return columns.flat().length < MOST_PANELS ? withColumns(layout, [...columns, [{ kind, settings: {} }]]) : layout;
}

export function removePanel(layout: Layout, column: number, row: number): Layout {
  return withColumns(
    layout,
    shownIn(layout).map((places, at) => (at === column ? places.filter((_, index) => index !== row) : places)),
  );
}

export function setSettings(layout: Layout, column: number, row: number, settings: Settings): Layout {
  return withColumns(
    layout,
    shownIn(layout).map((places, at) =>
      at === column ? places.map((place, index) => (index === row ? { ...place, settings } : place)) : places,
    ),
  );
}

/** Returns the layout with a field plotted: in the last plot of the shown view, or in a new one beside the others. */
export function withPlot(layout: Layout, address: string): Layout {
  const shown = shownIn(layout).some((places) => places.some(({ kind }) => kind === "plot")) ? layout : addPanel(layout, "plot");
  const columns = shownIn(shown);
  const column = columns.findLastIndex((places) => places.some(({ kind }) => kind === "plot"));
  const row = columns[column]?.findLastIndex(({ kind }) => kind === "plot") ?? -1;
  const settings = columns[column]?.[row]?.settings;
  return settings === undefined ? layout : setSettings(shown, column, row, withLine(settings, address));
}

/** Returns the fragment of a layout; empty for the first view as it begins. */
export function fragmentOf(layout: Layout, first: string): string {
  if (layout.view === first && Object.keys(layout.views).length === 0) return "";
  return `#${KEY}${encodeURIComponent(JSON.stringify(layout))}`;
}

/** Reads a fragment; whatever is no layout of these kinds is left out, since anyone may write an address. */
export function readFragment(fragment: string, kinds: readonly string[]): Layout {
  const first = kinds[0] ?? "";
  const text = fragment.replace(/^#/, "").split("&").find((part) => part.startsWith(KEY));
  if (text === undefined) return { view: first, views: {} };
  try {
    return readLayout(JSON.parse(decodeURIComponent(text.slice(KEY.length))), kinds);
  } catch {
    return { view: first, views: {} };
  }
}

/** Reads a layout as JSON, from an address or from a launch file. */
export function readLayout(data: unknown, kinds: readonly string[]): Layout {
  const known = new Set(kinds);
  if (!isRecord(data)) return { view: kinds[0] ?? "", views: {} };
  const view = typeof data.view === "string" && known.has(data.view) ? data.view : (kinds[0] ?? "");
  const views: Record<string, Columns> = {};
  for (const [kind, columns] of Object.entries(isRecord(data.views) ? data.views : {})) {
    const read = readColumns(columns, known);
    if (known.has(kind) && read.length > 0) views[kind] = read;
  }
  return { view, views };
}

function readColumns(data: unknown, known: ReadonlySet<string>): Columns {
  if (!Array.isArray(data)) return [];
  let left = MOST_PANELS;
  return data
    .map((column: unknown): readonly Place[] => {
      const places = Array.isArray(column) ? column.flatMap((place: unknown) => readPlace(place, known)) : [];
      const taken = places.slice(0, left);
      left -= taken.length;
      return taken;
    })
    .filter((column) => column.length > 0);
}

function readPlace(data: unknown, known: ReadonlySet<string>): readonly Place[] {
  if (!isRecord(data) || typeof data.kind !== "string" || !known.has(data.kind)) return [];
  return [{ kind: data.kind, settings: isRecord(data.settings) ? data.settings : {} }];
}

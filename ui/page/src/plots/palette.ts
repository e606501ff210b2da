/** Palette: the colours of a plot, as the page's theme has them where the plot stands. */

export interface Palette {
  readonly paper: string;
  readonly ink: string;
  readonly quiet: string;
  readonly grid: string;
  readonly accent: string;
  readonly series: readonly string[];
}

const SERIES = 8;
// After the eighth line the colours begin again, with another dash: a line is never known by its colour alone.
const DASHES: readonly (readonly number[])[] = [[], [8, 4], [2, 3], [8, 3, 2, 3]];

export function paletteOf(element: Element): Palette {
  const style = getComputedStyle(element);
  const colour = (name: string, otherwise: string): string => style.getPropertyValue(name).trim() || otherwise;
  return {
    paper: colour("--paper", "#fff"),
    ink: colour("--ink", "#1a2027"),
    quiet: colour("--ink-3", "#626d79"),
    grid: colour("--line", "#dfe3e8"),
    accent: colour("--accent", "#0a5fc4"),
    series: Array.from({ length: SERIES }, (_, at) => colour(`--series-${at + 1}`, "#0a5fc4")),
  };
}

/** Returns the number of a line's colour, from 1. */
export function colourNumber(at: number): number {
  return (at % SERIES) + 1;
}

export function strokeOf(palette: Palette, at: number): string {
  return palette.series[at % SERIES] ?? palette.accent;
}

export function dashOf(at: number): readonly number[] {
  return DASHES[Math.floor(at / SERIES) % DASHES.length] ?? [];
}

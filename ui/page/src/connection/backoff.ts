/** The pause before the next attempt to connect. */

const FIRST_MS = 250;
const MOST_MS = 5_000;

/** Returns the pause after so many failed attempts: doubled each time, at most 5 s, spread by ±20 %. */
export function backoffMs(failures: number, random: () => number = Math.random): number {
  const pause = Math.min(MOST_MS, FIRST_MS * 2 ** Math.max(0, failures - 1));
  return Math.round(pause * (0.8 + 0.4 * random()));
}

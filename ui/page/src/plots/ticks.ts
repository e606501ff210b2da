/** Ticks: where the time axis has marks, and what stands there. */

import { stampText } from "../messages/stamps";

/** Distances between marks, in seconds: those of a clock from a second on. */
export const DISTANCES_S: readonly number[] = [
  ...[1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1].flatMap((size) => [1, 2, 5].map((step) => step * size)),
  ...[1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 14_400, 28_800, 86_400],
];

/** Returns the text of a mark, with as many digits as the distance between marks needs. */
export function tickText(stampNs: bigint, distanceS: number): string {
  const digits = distanceS >= 1 ? 0 : Math.min(9, Math.ceil(-Math.log10(distanceS) - 1e-9));
  return stampText(stampNs, digits);
}

/** Returns a number as a legend shows it: at most six digits that matter, without a needless exponent. */
export function numberText(value: number): string {
  if (Number.isInteger(value) && Math.abs(value) < 1e15) return String(value);
  const size = Math.abs(value);
  return size >= 1e-3 && size < 1e6 ? String(Number(value.toPrecision(6))) : value.toExponential(4);
}

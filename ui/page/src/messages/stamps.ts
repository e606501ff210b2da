/** Stamps: when a message was made, in nanoseconds, and the moments that a page shows. */

import { isRecord } from "./paths";

const SECOND_NS = 1_000_000_000n;
// A header that is further from the moment of publishing than this is of another clock: a driver's, or a simulation's.
const SAME_CLOCK_NS = 600n * SECOND_NS;

/** Returns the stamp in the header of a message; undefined without a header, or if nothing set its stamp. */
export function headerStampNs(message: unknown): bigint | undefined {
  const header = isRecord(message) ? message.header : undefined;
  return isRecord(header) ? timeNs(header.stamp) : undefined;
}

/** Returns a time of ROS in nanoseconds; undefined if the value is none, or is zero, which means that it was not set. */
export function timeNs(value: unknown): bigint | undefined {
  if (!isRecord(value) || typeof value.sec !== "number" || typeof value.nanosec !== "number") return undefined;
  const { sec, nanosec } = value;
  if (!Number.isInteger(sec) || !Number.isInteger(nanosec) || (sec === 0 && nanosec === 0)) return undefined;
  return BigInt(sec) * SECOND_NS + BigInt(nanosec);
}

/** Returns the stamp by which a message is plotted: its header's, or if that is of another clock, the moment of publishing. */
export function stampNs(message: unknown, publishedNs: bigint): bigint {
  const stamp = headerStampNs(message);
  if (stamp === undefined) return publishedNs;
  const apart = stamp > publishedNs ? stamp - publishedNs : publishedNs - stamp;
  return apart > SAME_CLOCK_NS ? publishedNs : stamp;
}

/** Returns the seconds from one stamp to another; exact to the nanosecond for 100 days. */
export function secondsBetween(originNs: bigint, stamp: bigint): number {
  return Number(stamp - originNs) / 1e9;
}

/** Returns the stamp so many seconds after another. */
export function stampAfter(originNs: bigint, seconds: number): bigint {
  return originNs + BigInt(Math.round(seconds * 1e9));
}

/** Returns a stamp as text: time of day, or seconds where it is no time of this century, as in a simulation. */
export function stampText(stamp: bigint, digits = 3): string {
  const seconds = stamp / SECOND_NS;
  const fraction = String(((stamp % SECOND_NS) + SECOND_NS) % SECOND_NS)
    .padStart(9, "0")
    .slice(0, digits);
  const tail = digits > 0 ? `.${fraction}` : "";
  if (seconds < 946_684_800n || seconds > 4_102_444_800n) return `${seconds}${tail} s`;
  const date = new Date(Number(seconds) * 1000);
  const two = (part: number): string => String(part).padStart(2, "0");
  return `${two(date.getHours())}:${two(date.getMinutes())}:${two(date.getSeconds())}${tail}`;
}

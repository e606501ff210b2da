/** Numbers, names and errors as people read them. */

/** Returns a rate such as `100 Hz`, `9.9 Hz`, `1.2 kHz`; never more than eight characters. */
export function rateText(hz: number): string {
  if (hz >= 1000) return `${(hz / 1000).toFixed(hz >= 99_950 ? 0 : 1)} kHz`;
  if (hz === 0) return "0 Hz";
  return `${hz.toFixed(hz >= 9.95 ? 0 : 1)} Hz`;
}

/** Returns a count with its thousands set apart. */
export function countText(count: number): string {
  return Math.round(count).toString().replace(/\B(?=(\d{3})+$)/g, "\u202f"); // narrow no-break space
}

/** Returns a time such as `1.2 ms`, `35 µs`, `2.0 s`. */
export function secondsText(seconds: number): string {
  const size = Math.abs(seconds);
  if (size === 0) return "0";
  if (size < 0.000_999_5) return `${(seconds * 1e6).toFixed(0)} µs`;
  if (size < 0.999_5) return `${(seconds * 1e3).toFixed(size < 0.0995 ? 1 : 0)} ms`;
  return `${seconds.toFixed(size < 9.95 ? 1 : 0)} s`;
}

/** Returns how long something has run: `4:05`, `1:02:03`. */
export function durationText(seconds: number): string {
  const whole = Math.max(0, Math.floor(seconds));
  const [hours, minutes, rest] = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60, whole % 60];
  const tail = String(rest).padStart(2, "0");
  return hours > 0 ? `${hours}:${String(minutes).padStart(2, "0")}:${tail}` : `${minutes}:${tail}`;
}

/** Returns `1 message`, `2 messages`. */
export function counted(count: number, one: string, many = `${one}s`): string {
  return `${countText(count)} ${count === 1 ? one : many}`;
}

/** Returns the namespace of a name: `/imu` of `/imu/data`, `/` of `/data`. */
export function namespaceOf(name: string): string {
  return name.slice(0, Math.max(0, name.lastIndexOf("/"))) || "/";
}

/** Returns the time of day of a stamp, by the browser's zone: `14:03:05.123`. */
export function clockText(stampNs: number): string {
  const date = new Date(stampNs / 1e6);
  const two = (value: number): string => String(value).padStart(2, "0");
  const ms = String(date.getMilliseconds()).padStart(3, "0");
  return `${two(date.getHours())}:${two(date.getMinutes())}:${two(date.getSeconds())}.${ms}`;
}

/** Returns the text of what was thrown or rejected. */
export function errorText(error: unknown): string {
  return error instanceof Error ? error.message : String(error);
}

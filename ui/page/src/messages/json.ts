/** JSON read without loss: an integer beyond 2^53 becomes a bigint. */

const TOKEN = /"(?:[^"\\]|\\.)*"|-?(?:0|[1-9]\d*)(?:\.\d+)?(?:[eE][+-]?\d+)?/g;
const LONG = /\d{16}/;
// Stands in front of an integer while it is carried as text; new for each page, so that no message can contain it.
const MARK = `integer ${Math.random().toString(36).slice(2)} `;
const MARKED = new RegExp(`"${MARK}(-?\\d+)"`, "g");

/** Parses JSON; throws a SyntaxError. */
export function parseJson(text: string): unknown {
  if (!LONG.test(text)) return JSON.parse(text) as unknown;
  const marked = text.replace(TOKEN, (token) => (isLarge(token) ? `"${MARK}${token}"` : token));
  return JSON.parse(marked, (_, value: unknown) => {
    return typeof value === "string" && value.startsWith(MARK) ? BigInt(value.slice(MARK.length)) : value;
  }) as unknown;
}

function isLarge(token: string): boolean {
  return /^-?\d{16,40}$/.test(token) && !Number.isSafeInteger(Number(token));
}

/** Writes JSON, a bigint as the integer that it is, and infinities and NaN as busflow writes them, as text. */
export function jsonText(value: unknown, indent?: number): string {
  const text = JSON.stringify(
    value,
    (_, each: unknown) => {
      if (typeof each === "bigint") return `${MARK}${each}`;
      if (typeof each === "number" && !Number.isFinite(each)) return Number.isNaN(each) ? ".nan" : `${each < 0 ? "-" : ""}.inf`;
      return ArrayBuffer.isView(each) ? [...(each as unknown as Iterable<unknown>)] : each;
    },
    indent,
  );
  return text.replaceAll(MARKED, "$1");
}

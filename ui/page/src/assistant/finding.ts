/** Finding of text in a page that has no places of its source: other sites, and pages that were changed. */

/** Text without differences in its spaces, with the place of each of its characters in the text as it was. */
export interface Folded {
  readonly text: string;
  readonly places: readonly number[];
}

/** Returns a text with one space for each stretch of spaces, and without marks of Markdown where these are left out. */
export function folded(text: string, leaveOut?: RegExp): Folded {
  const places: number[] = [];
  let found = "";
  for (let at = 0; at < text.length; at += 1) {
    const letter = text.charAt(at);
    if (leaveOut?.test(letter)) continue;
    const isSpace = /\s/.test(letter);
    if (isSpace && (found === "" || found.endsWith(" "))) continue;
    found += isSpace ? " " : letter;
    places.push(at);
  }
  return { text: found, places };
}

const MARKS = /[`*]/;

/** Returns where a text stands in another, whatever their spaces and marks; undefined where it does not. */
export function placeIn(page: string, wanted: string): { readonly from: number; readonly to: number } | undefined {
  const haystack = folded(page);
  const direct = folded(wanted).text.trim();
  const needle = haystack.text.includes(direct) ? direct : folded(wanted, MARKS).text.trim();
  const at = needle === "" ? -1 : haystack.text.indexOf(needle);
  if (at < 0) return undefined;
  return { from: haystack.places[at] ?? 0, to: (haystack.places[at + needle.length - 1] ?? 0) + 1 };
}

/** Returns the range of an element that shows a text; undefined where none does. */
export function rangeWith(root: Element, wanted: string): Range | undefined {
  const nodes: Text[] = [];
  const walker = document.createTreeWalker(root, NodeFilter.SHOW_TEXT);
  for (let node = walker.nextNode(); node !== null; node = walker.nextNode()) nodes.push(node as Text);
  const place = placeIn(nodes.map(({ data }) => data).join(""), wanted);
  if (place === undefined) return undefined;
  const range = document.createRange();
  let at = 0;
  for (const node of nodes) {
    if (at <= place.from && place.from < at + node.length) range.setStart(node, place.from - at);
    if (at < place.to && place.to <= at + node.length) range.setEnd(node, place.to - at);
    at += node.length;
  }
  return range;
}

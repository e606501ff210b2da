/** Places: the part of a page that shows given characters of its Markdown, and marks around it. */

/** A stretch of text of one element. */
export interface Stretch {
  readonly from: number;
  readonly to: number;
}

/** Number of characters, as Python counts them: a pair of surrogates is one. */
export function characters(text: string): number {
  let count = 0;
  for (let at = 0; at < text.length; at += unitsAt(text, at)) count += 1;
  return count;
}

/** Returns where a character begins in a text of the browser, which counts a pair of surrogates as two. */
export function unitsBefore(text: string, count: number): number {
  let at = 0;
  for (let left = count; left > 0 && at < text.length; left -= 1) at += unitsAt(text, at);
  return at;
}

function unitsAt(text: string, at: number): 1 | 2 {
  return (text.codePointAt(at) ?? 0) > 0xffff ? 2 : 1;
}

/** Text of an element, with the place of its first character in the source. */
export interface Placed {
  readonly text: string;
  readonly first: number;
  /** Where its source ends, if the text is not the source's own: it is shown whole or not at all. */
  readonly last: number | undefined;
}

/** Returns the stretch of an element's text that shows source from `start` to `end`, in units of the browser. */
export function stretchOf({ text, first, last }: Placed, start: number, end: number): Stretch | undefined {
  const behind = last ?? first + characters(text);
  if (behind <= start || first >= end) return undefined;
  if (last !== undefined) return { from: 0, to: text.length };
  return { from: unitsBefore(text, Math.max(0, start - first)), to: unitsBefore(text, end - first) };
}

/** Returns the ranges of a page that show source from `start` to `end`; those of whole blocks where nothing finer is known. */
export function rangesOf(root: Element, start: number, end: number): Range[] {
  const found = [...root.querySelectorAll<HTMLElement>("[data-s]")].flatMap((element) => {
    const { s, e } = element.dataset;
    const placed = { text: element.textContent, first: Number(s), last: e === undefined ? undefined : Number(e) };
    const stretch = stretchOf(placed, start, end);
    return stretch === undefined || stretch.from >= stretch.to ? [] : [rangeOf(element, stretch)];
  });
  return found.length > 0 ? found : blocksOf(root, start, end);
}

function blocksOf(root: Element, start: number, end: number): Range[] {
  const blocks = [...root.querySelectorAll<HTMLElement>("[data-from]")].filter(
    ({ dataset: { from, to } }) => Number(from) < end && Number(to) > start,
  );
  return blocks
    .filter((block) => !blocks.some((other) => other !== block && block.contains(other)))
    .map((block) => rangeOf(block, { from: 0, to: block.textContent.length }));
}

function rangeOf(element: Element, { from, to }: Stretch): Range {
  const range = document.createRange();
  const [first, before] = pointAt(element, from, false);
  const [last, after] = pointAt(element, to, true);
  range.setStart(first, before);
  range.setEnd(last, after);
  return range;
}

/** Returns the text node of a character, and its number there; at a border the one before or behind it. */
function pointAt(element: Element, at: number, isEnd: boolean): [Node, number] {
  const walker = document.createTreeWalker(element, NodeFilter.SHOW_TEXT);
  let left = at;
  let last: [Node, number] = [element, 0];
  for (let node = walker.nextNode(); node !== null; node = walker.nextNode()) {
    const length = (node as Text).length;
    if (isEnd ? left <= length : left < length) return [node, left];
    left -= length;
    last = [node, length];
  }
  return last;
}

const WORD = "cited";

/** Marks ranges; returns the first mark. */
export function mark(ranges: readonly Range[]): HTMLElement | undefined {
  const parts = ranges.flatMap(textsIn);
  const marks = parts.map(({ node, from, to }) => {
    const part = from === 0 ? node : node.splitText(from);
    if (to - from < part.length) part.splitText(to - from);
    const element = document.createElement("mark");
    element.className = WORD;
    part.replaceWith(element);
    element.append(part);
    return element;
  });
  return marks[0];
}

/** Removes all marks of a page. */
export function unmark(root: ParentNode): void {
  for (const element of root.querySelectorAll(`mark.${WORD}`)) {
    const parent = element.parentNode;
    element.replaceWith(...element.childNodes);
    parent?.normalize();
  }
}

function textsIn(range: Range): { readonly node: Text; readonly from: number; readonly to: number }[] {
  const { commonAncestorContainer: within } = range;
  const walker = document.createTreeWalker(within, NodeFilter.SHOW_TEXT);
  const nodes: Text[] = within instanceof Text ? [within] : [];
  for (let node = walker.nextNode(); node !== null; node = walker.nextNode()) if (range.intersectsNode(node)) nodes.push(node as Text);
  return nodes
    .map((node) => ({
      node,
      from: node === range.startContainer ? range.startOffset : 0,
      to: node === range.endContainer ? range.endOffset : node.length,
    }))
    .filter(({ node, from, to }) => from < to && node.data.slice(from, to).trim() !== "");
}

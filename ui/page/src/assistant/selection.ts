/** Selection: what a reader has selected in the text, at most 20 kB of it. */
import { signal, type ReadonlySignal } from "@preact/signals";

/** Bytes of a selection that are asked about. */
export const MOST_BYTES = 20_000;

export interface Cut {
  readonly text: string;
  readonly isCut: boolean;
}

/** Returns the first 20 kB of a text, without half a character at the end. */
export function cut(text: string): Cut {
  if (text.length * 3 <= MOST_BYTES) return { text, isCut: false };
  const bytes = new TextEncoder().encode(text);
  if (bytes.length <= MOST_BYTES) return { text, isCut: false };
  let end = MOST_BYTES;
  while (((bytes[end] ?? 0) & 0xc0) === 0x80) end -= 1;
  return { text: new TextDecoder().decode(bytes.subarray(0, end)), isCut: true };
}

export interface Chosen extends Cut {
  readonly range: Range;
}

/** Follows the selection in the element that `root` returns: made with a mouse, a keyboard or a finger alike. */
export function chosenIn(root: () => Element | null): ReadonlySignal<Chosen | undefined> {
  const chosen = signal<Chosen | undefined>();
  let frame = 0;
  // In a field that Tab comes to the browser selects anew. The reader has not: the button may be behind that field.
  let isTabbing = false;
  const look = (): void => {
    frame = 0;
    const found = now(root());
    if (found !== undefined || !isTabbing) chosen.value = found;
  };
  document.addEventListener("keydown", ({ key }) => (isTabbing = key === "Tab"), { capture: true });
  document.addEventListener("pointerdown", () => (isTabbing = false), { capture: true });
  document.addEventListener("selectionchange", () => {
    if (frame === 0) frame = requestAnimationFrame(look);
  });
  return chosen;
}

function now(root: Element | null): Chosen | undefined {
  const selection = document.getSelection();
  if (root === null || selection === null || selection.isCollapsed || selection.rangeCount === 0) return undefined;
  const range = selection.getRangeAt(0);
  if (!range.intersectsNode(root)) return undefined;
  const inside = range.cloneRange();
  const isWhole = root.contains(range.commonAncestorContainer);
  if (!root.contains(inside.startContainer)) inside.setStart(root, 0);
  if (!root.contains(inside.endContainer)) inside.setEnd(root, root.childNodes.length);
  const text = (isWhole ? selection.toString() : inside.toString()).trim();
  return text === "" ? undefined : { ...cut(text), range: inside };
}

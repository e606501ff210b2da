/** The button beside a selection: the browser's own element, since it stands in the text that it is about. */

export const LABEL = "AI Assistant";
const GAP = 8;

export class FloatingButton {
  readonly element: HTMLButtonElement;

  constructor(onClick: () => void) {
    this.element = document.createElement("button");
    this.element.type = "button";
    this.element.className = "assistant-button floating";
    this.element.textContent = LABEL;
    // A press must not take the selection away before the click comes.
    this.element.addEventListener("pointerdown", (event) => event.preventDefault());
    this.element.addEventListener("mousedown", (event) => event.preventDefault());
    this.element.addEventListener("click", onClick);
  }

  /** Shows it behind the last line of a range, and in the order of Tab behind the block with its end. */
  show(range: Range, root: Element, within?: ParentNode): void {
    const rectangle = [...range.getClientRects()].at(-1) ?? range.getBoundingClientRect();
    if (within === undefined) blockIn(root, range.endContainer).after(this.element);
    else within.append(this.element);
    const { offsetWidth, offsetHeight, style } = this.element;
    const below = rectangle.bottom + GAP;
    const top = Math.max(GAP, below + offsetHeight < innerHeight ? below : Math.min(rectangle.top, innerHeight - offsetHeight) - GAP - offsetHeight);
    style.left = `${Math.max(GAP, Math.min(rectangle.right, innerWidth - offsetWidth - GAP)) + scrollX}px`;
    style.top = `${top + scrollY}px`;
  }

  hide(): void {
    this.element.remove();
  }
}

/** Returns the outermost block of the text that holds a node. */
function blockIn(root: Element, node: Node): ChildNode {
  let found: Node = node;
  while (found.parentNode !== root && found.parentNode !== null && root.contains(found.parentNode)) found = found.parentNode;
  return found === root || !root.contains(found) ? (root.lastChild ?? root) : (found as ChildNode);
}

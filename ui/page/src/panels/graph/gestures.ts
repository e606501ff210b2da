/** Gestures: dragging, the wheel and two fingers move and enlarge the drawing. */
import { useSignal, type ReadonlySignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import type { Point } from "./geometry";
import { pan, zoom, type Viewport } from "./viewport";

/** Distance in pixels from which a press is a drag and no click. */
const SLACK = 4;

/** Follows the pointers over an element; returns whether it is being dragged. */
export function useGestures(
  frame: { readonly current: HTMLElement | null },
  view: Viewport,
  onView: (view: Viewport) => void,
): ReadonlySignal<boolean> {
  const isDragging = useSignal(false);
  const now = useRef({ view, onView });
  now.current = { view, onView };
  useEffect(() => {
    const element = frame.current;
    if (element === null) return undefined;
    const change = (next: Viewport) => {
      now.current.view = next;
      now.current.onView(next);
    };
    const ending = new AbortController();
    const { signal } = ending;
    followWheel(element, (factor, at) => change(zoom(now.current.view, factor, at)), signal);
    followFingers(
      element,
      {
        onPan: (dx, dy) => change(pan(now.current.view, dx, dy)),
        onZoom: (factor, at) => change(zoom(now.current.view, factor, at)),
        onDragging: (on) => (isDragging.value = on),
      },
      signal,
    );
    return () => ending.abort();
  }, [frame, isDragging]);
  return isDragging;
}

function followWheel(element: HTMLElement, onZoom: (factor: number, at: Point) => void, signal: AbortSignal): void {
  const onWheel = (event: WheelEvent) => {
    event.preventDefault();
    const lines = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 16 : 1;
    onZoom(Math.exp(-event.deltaY * lines * (event.ctrlKey ? 0.01 : 0.0015)), within(element, event));
  };
  element.addEventListener("wheel", onWheel, { passive: false, signal });
}

interface FingerEvents {
  readonly onPan: (dx: number, dy: number) => void;
  readonly onZoom: (factor: number, at: Point) => void;
  readonly onDragging: (on: boolean) => void;
}

function followFingers(element: HTMLElement, on: FingerEvents, signal: AbortSignal): void {
  const fingers = new Map<number, Point>();
  let travelled = 0;
  element.addEventListener(
    "pointerdown",
    (event) => {
      if (event.button !== 0 || (event.target as Element).closest(".zoom") !== null) return;
      fingers.set(event.pointerId, within(element, event));
      travelled = 0;
    },
    { signal },
  );
  element.addEventListener(
    "pointermove",
    (event) => {
      const before = fingers.get(event.pointerId);
      if (before === undefined) return;
      const finger = within(element, event);
      travelled += distance(before, finger);
      if (travelled < SLACK) return;
      element.setPointerCapture(event.pointerId);
      on.onDragging(true);
      const other = [...fingers].find(([id]) => id !== event.pointerId)?.[1];
      if (other === undefined) on.onPan(finger.x - before.x, finger.y - before.y);
      else on.onZoom(distance(other, finger) / Math.max(1, distance(other, before)), other);
      fingers.set(event.pointerId, finger);
    },
    { signal },
  );
  const end = ({ pointerId }: PointerEvent) => {
    fingers.delete(pointerId);
    if (fingers.size === 0) on.onDragging(false);
  };
  element.addEventListener("pointerup", end, { signal });
  element.addEventListener("pointercancel", end, { signal });
  // The click that ends a drag selects nothing.
  element.addEventListener(
    "click",
    (event) => {
      if (travelled >= SLACK) event.stopPropagation();
      travelled = 0;
    },
    { capture: true, signal },
  );
}

function within(element: HTMLElement, event: MouseEvent): Point {
  const { left, top } = element.getBoundingClientRect();
  return { x: event.clientX - left, y: event.clientY - top };
}

function distance(one: Point, other: Point): number {
  return Math.hypot(one.x - other.x, one.y - other.y);
}

/** Drawing: the graph as SVG, which can be moved, enlarged and walked through with the keyboard. */
import { useSignal } from "@preact/signals";
import { useEffect, useLayoutEffect, useMemo, useRef } from "preact/hooks";
import { Icon } from "../../controls/icons";
import { EdgeLabel, EdgeShape, Markers } from "./edge";
import { isOfGroup } from "./folding";
import type { Box, Size } from "./geometry";
import { useGestures } from "./gestures";
import { beginningOf, bestLayout, structureOf, type Layout } from "./layout";
import { measureText } from "./measure";
import type { Edge, GraphModel, Vertex } from "./model";
import { nearest, type Direction } from "./neighbours";
import type { Route } from "./route";
import { VertexShape } from "./vertex";
import { fit, pan, READABLE, readable, reveal, zoom, type Viewport } from "./viewport";

interface DrawingProps {
  readonly model: GraphModel;
  readonly selected: string | null;
  /** Whether a vertex matches the search; all do without one. */
  readonly matches: (vertex: Vertex) => boolean;
  readonly onSelect: (id: string | null) => void;
  /** Folds a group that is drawn with its members. */
  readonly onFold: (group: string) => void;
}

const ARROWS: Readonly<Record<string, Direction>> = {
  ArrowLeft: "left",
  ArrowRight: "right",
  ArrowUp: "up",
  ArrowDown: "down",
};
const STEP = 1.25;

export function Drawing({ model, selected, matches, onSelect, onFold }: DrawingProps) {
  const frame = useRef<HTMLDivElement>(null);
  const size = useSize(frame);
  const layout = useLayout(model, size);
  // Until the person moves it, the drawing follows the panel's size, with names that can be read.
  const moved = useSignal<Viewport | "whole" | null>(null);
  const view = moved.value === "whole" ? fit(layout.size, size) : (moved.value ?? readable(layout.size, size, beginningOf(layout)));
  const setView = (next: Viewport) => (moved.value = next);
  const isDragging = useGestures(frame, view, setView);
  // With a group that is opened or folded everything moves: what was seen is no longer there.
  const select = (id: string | null) => {
    if (id !== null && isOfGroup(id)) moved.value = null;
    onSelect(id);
  };
  const fold = (group: string) => {
    moved.value = null;
    onFold(group);
  };
  const middle = { x: size.width / 2, y: size.height / 2 };
  useReveal(layout, selected, size, (change) => {
    const next = change(view);
    if (next !== view) setView(next);
  });

  const onKeyDown = (event: KeyboardEvent) => {
    const direction = ARROWS[event.key];
    if (direction !== undefined) moveFocus(event, layout, direction, (dx, dy) => setView(pan(view, dx, dy)));
    else if (event.key === "+" || event.key === "=") setView(zoom(view, STEP, middle));
    else if (event.key === "-") setView(zoom(view, 1 / STEP, middle));
    else if (event.key === "0") moved.value = null;
    else if (event.key === "Escape") onSelect(null);
    else return;
    event.preventDefault();
  };
  return (
    <>
      <div
        ref={frame}
        class={`drawing ${isDragging.value ? "dragging" : ""}`}
        onKeyDown={onKeyDown}
        onClick={(event) => event.target === event.currentTarget.firstElementChild && onSelect(null)}
      >
        <svg width="100%" height="100%" role="group" aria-label="The graph. Arrow keys walk through it; the list beside it has the same.">
          <Markers />
          {size.width > 0 && (
            <g transform={`translate(${view.x} ${view.y}) scale(${view.scale})`}>
              <Content model={model} layout={layout} selected={selected} matches={matches} onSelect={select} onFold={fold} />
            </g>
          )}
        </svg>
      </div>
      <div class="zoom" role="group" aria-label="Zoom">
        <ZoomButton icon="plus" label="Enlarge" onClick={() => setView(zoom(view, STEP, middle))} />
        <ZoomButton icon="minus" label="Shrink" onClick={() => setView(zoom(view, 1 / STEP, middle))} />
        <ZoomButton icon="fit" label="Show all" onClick={() => (moved.value = "whole")} />
      </div>
    </>
  );
}

function ZoomButton(props: { readonly icon: string; readonly label: string; readonly onClick: () => void }) {
  return (
    <button type="button" class="button plain icon" title={props.label} aria-label={props.label} onClick={props.onClick}>
      <Icon name={props.icon} />
    </button>
  );
}

/** Groups, edges and vertices, from the back to the front. */
function Content({ model, layout, selected, matches, onSelect, onFold }: DrawingProps & { readonly layout: Layout }) {
  const related = relatedTo(selected, model);
  const first = model.vertices[0]?.id;
  return (
    <>
      {[...layout.groups].map(([name, box]) => (
        <GroupFrame key={name} name={name} box={box} onFold={() => onFold(name)} />
      ))}
      {[...model.edges].sort(silentFirst).map((edge) => (
        <EdgeShape
          key={edge.id}
          edge={edge}
          route={layout.edges.get(edge.id) ?? NOWHERE}
          flow={layout.flow}
          isSelected={edge.id === selected}
          isDim={related !== null && !related.has(edge.id)}
          onSelect={() => onSelect(edge.id)}
        />
      ))}
      {model.vertices.map((vertex) => {
        const box = layout.vertices.get(vertex.id);
        return box === undefined ? null : (
          <VertexShape
            key={vertex.id}
            vertex={vertex}
            box={box}
            isSelected={vertex.id === selected}
            isDim={!matches(vertex) || (related !== null && !related.has(vertex.id))}
            isTabStop={vertex.id === (selected !== null && layout.vertices.has(selected) ? selected : first)}
            onSelect={() => onSelect(vertex.id)}
          />
        );
      })}
      {model.edges.map(({ id, label }) => {
        const route = layout.edges.get(id);
        if (label === null || route === undefined || (related !== null && !related.has(id))) return null;
        return <EdgeLabel key={id} text={label} route={route} flow={layout.flow} />;
      })}
    </>
  );
}

/** The frame around a group; its name folds it. */
function GroupFrame({ name, box, onFold }: { readonly name: string; readonly box: Box; readonly onFold: () => void }) {
  const onKeyDown = (event: KeyboardEvent) => {
    if (event.key !== "Enter" && event.key !== " ") return;
    event.preventDefault();
    onFold();
  };
  return (
    <g class="group-frame">
      <rect {...box} rx="10" />
      <text x={box.x + 12} y={box.y + 15} role="button" tabindex={-1} data-group={name} onClick={onFold} onKeyDown={onKeyDown}>
        {name}
        <title>Fold {name}</title>
      </text>
    </g>
  );
}

const NOWHERE: Route = { points: [], isArc: false };
const RANKS = { silent: 0, flowing: 1, dropping: 2 };
const silentFirst = (one: Edge, other: Edge): number => RANKS[one.look] - RANKS[other.look];

/** Returns the ids of what is selected and of what it is connected to; null where nothing is selected. */
function relatedTo(selected: string | null, model: GraphModel): ReadonlySet<string> | null {
  if (selected === null) return null;
  const edges = model.edges.filter((edge) => [edge.id, edge.from, edge.to].includes(selected));
  const isKnown = edges.length > 0 || model.vertices.some(({ id }) => id === selected);
  return isKnown ? new Set([selected, ...edges.flatMap((edge) => [edge.id, edge.from, edge.to])]) : null;
}

function moveFocus(event: KeyboardEvent, layout: Layout, direction: Direction, move: (dx: number, dy: number) => void) {
  const from = event.target instanceof Element ? event.target.getAttribute("data-vertex") : null;
  if (from === null) {
    const sign = direction === "left" || direction === "up" ? 1 : -1;
    move(direction === "left" || direction === "right" ? sign * 60 : 0, direction === "up" || direction === "down" ? sign * 60 : 0);
    return;
  }
  const next = nearest(layout.vertices, from, direction);
  if (next === null) return;
  const found = [...(event.currentTarget as Element).querySelectorAll<SVGElement>("[data-vertex]")];
  found.find((element) => element.getAttribute("data-vertex") === next)?.focus();
}

const NOTHING: Layout = { flow: "right", vertices: new Map(), edges: new Map(), groups: new Map(), size: { width: 0, height: 0 } };

/** The layout of the model, made anew only when its structure or the screen's shape changes: rates never move anything. */
function useLayout(model: GraphModel, { width, height }: Size): Layout {
  const screen = { width: Math.round(width / 100) * 100, height: Math.round(height / 100) * 100 };
  const isMeasured = width > 0;
  return useMemo(
    () => (isMeasured ? bestLayout(model, measureText, screen) : NOTHING),
    [structureOf(model), isMeasured, screen.width, screen.height],
  );
}

function useSize(frame: { readonly current: HTMLElement | null }): Size {
  const size = useSignal<Size>({ width: 0, height: 0 });
  useLayoutEffect(() => {
    const element = frame.current;
    if (element === null) return undefined;
    const measure = (): void => {
      const { clientWidth: width, clientHeight: height } = element;
      if (width !== size.peek().width || height !== size.peek().height) size.value = { width, height };
    };
    measure(); // the observer is called a frame later
    const observer = new ResizeObserver(measure);
    observer.observe(element);
    return () => observer.disconnect();
  }, [frame, size]);
  return size.value;
}

/** Moves the drawing so that a vertex that was selected elsewhere, as in the list, is seen. */
function useReveal(
  layout: Layout,
  selected: string | null,
  size: Size,
  change: (next: (view: Viewport) => Viewport) => void,
): void {
  useEffect(() => {
    const box = selected === null ? undefined : layout.vertices.get(selected);
    if (box !== undefined && size.width > 0) change((view) => revealed(view, box, size));
    // Only a new selection moves the drawing; what changes in the graph does not.
  }, [selected]);
}

function revealed(view: Viewport, box: Box, size: Size): Viewport {
  const read = view.scale < READABLE ? zoom(view, READABLE / view.scale, { x: size.width / 2, y: size.height / 2 }) : view;
  return reveal(read, box, size);
}

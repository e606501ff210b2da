/** Edges as they are drawn: grey and thin, as wide as their rate, or red and dashed with a label. */
import type { Edge, EdgeLook } from "./model";
import { middleOf, pathOf, type Flow, type Route } from "./route";

const LOOKS: readonly EdgeLook[] = ["silent", "flowing", "dropping"];

/** The heads of arrows, one for each look. */
export function Markers() {
  return (
    <defs>
      {LOOKS.map((look) => (
        <marker
          key={look}
          id={`arrow-${look}`}
          class={`arrow ${look}`}
          viewBox="0 0 8 8"
          refX="7"
          refY="4"
          markerWidth="9"
          markerHeight="9"
          markerUnits="userSpaceOnUse"
          orient="auto"
        >
          <path d="M0 .8 7 4 0 7.2z" />
        </marker>
      ))}
    </defs>
  );
}

interface EdgeProps {
  readonly edge: Edge;
  readonly route: Route;
  readonly flow: Flow;
  readonly isSelected: boolean;
  readonly isDim: boolean;
  readonly onSelect: () => void;
}

export function EdgeShape({ edge, route, flow, isSelected, isDim, onSelect }: EdgeProps) {
  const path = pathOf(route, flow);
  const classes = ["edge", edge.kind, edge.look, isSelected && "selected", isDim && "dim"].filter(Boolean).join(" ");
  return (
    <g class={classes} role="button" tabindex={-1} aria-label={edge.sentence} data-edge={edge.id} onClick={onSelect}>
      <title>{edge.sentence}</title>
      <path class="reach" d={path} />
      <path class="line" d={path} stroke-width={edge.width.toFixed(2)} marker-end={`url(#arrow-${edge.look})`} />
    </g>
  );
}

interface LabelProps {
  readonly text: string;
  readonly route: Route;
  readonly flow: Flow;
}

/** The label of an edge, which stands before everything else; the edge itself says the same. */
export function EdgeLabel({ text, route, flow }: LabelProps) {
  const width = text.length * 6.2 + 14;
  const { x, y } = middleOf(route, flow);
  return (
    <g class="edge-label" transform={`translate(${x} ${y})`} aria-hidden="true">
      <rect x={-width / 2} y="-10" width={width} height="20" rx="10" />
      <text y="4" text-anchor="middle">
        {text}
      </text>
    </g>
  );
}

/** Vertices as they are drawn: a node with its state, a topic with its rate, a service as a pill, an action with its goals. */
import type { Box } from "./geometry";
import type { Vertex } from "./model";
import { SignPath } from "./sign";

interface VertexProps {
  readonly vertex: Vertex;
  readonly box: Box;
  readonly isSelected: boolean;
  readonly isDim: boolean;
  readonly isTabStop: boolean;
  readonly onSelect: () => void;
}

export function VertexShape({ vertex, box, isSelected, isDim, isTabStop, onSelect }: VertexProps) {
  const classes = ["vertex", vertex.kind, vertex.tone, isSelected && "selected", isDim && "dim"].filter(Boolean).join(" ");
  const hasSign = vertex.kind === "node" || vertex.kind === "group";
  const onKeyDown = (event: KeyboardEvent) => {
    if (event.key !== "Enter" && event.key !== " ") return;
    event.preventDefault();
    onSelect();
  };
  return (
    <g
      class={classes}
      transform={`translate(${box.x} ${box.y})`}
      role="button"
      tabindex={isTabStop ? 0 : -1 /* SVG knows no tabIndex */}
      aria-label={vertex.sentence}
      aria-pressed={isSelected}
      data-vertex={vertex.id}
      onClick={onSelect}
      onKeyDown={onKeyDown}
    >
      {vertex.kind === "group" && <rect class="behind" x="4" y="4" width={box.width} height={box.height} rx={ROUNDING.group} />}
      {!vertex.name.endsWith(vertex.label) && <title>{vertex.name}</title>}
      <rect width={box.width} height={box.height} rx={ROUNDING[vertex.kind]} />
      <text class="name" x="12" y={vertex.kind === "service" ? 18 : 19}>
        {vertex.label}
      </text>
      {" " /* or its name would be one word with what follows, as it is read aloud */}
      {hasSign && (
        <g transform="translate(12 27.5)">
          <SignPath tone={vertex.tone} />
        </g>
      )}
      <text class="detail" x={hasSign ? 25 : 12} y="35.5">
        {vertex.detail}
      </text>
    </g>
  );
}

/** Nodes are the roundest but for services and actions, so that the four are told apart without their colours. */
const ROUNDING: Readonly<Record<Vertex["kind"], number>> = { node: 10, topic: 2, service: 14, action: 18, group: 4 };

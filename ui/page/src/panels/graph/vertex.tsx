/** Vertices as they are drawn: a node is a card with its state, a topic a strip with its rate, a service a pill. */
import type { Box } from "./layout";
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
      tabIndex={isTabStop ? 0 : -1}
      aria-label={vertex.sentence}
      aria-pressed={isSelected}
      data-vertex={vertex.id}
      onClick={onSelect}
      onKeyDown={onKeyDown}
    >
      <rect width={box.width} height={box.height} rx={vertex.kind === "node" ? 8 : vertex.kind === "topic" ? 4 : 14} />
      {vertex.kind === "node" ? <NodeText vertex={vertex} /> : <StripText vertex={vertex} box={box} />}
    </g>
  );
}

function NodeText({ vertex }: { readonly vertex: Vertex }) {
  return (
    <>
      <text class="name" x="14" y="19">
        {vertex.label}
      </text>
      <g transform="translate(14 27)">
        <SignPath tone={vertex.tone} />
      </g>
      <text class="detail" x="27" y="35">
        {vertex.detail}
      </text>
    </>
  );
}

function StripText({ vertex, box }: { readonly vertex: Vertex; readonly box: Box }) {
  return (
    <>
      <text class="name" x="12" y="18">
        {vertex.label}
      </text>
      {vertex.detail !== "" && (
        <text class="detail" x={box.width - 12} y="18" text-anchor="end">
          {vertex.detail}
        </text>
      )}
    </>
  );
}

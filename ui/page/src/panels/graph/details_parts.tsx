/** What the details of nodes, topics, services and edges have in common: their props, headings, sections and links. */
import type { ComponentChildren } from "preact";
import type { GraphState, Session } from "../../store/session";

export interface DetailsProps {
  readonly session: Session;
  readonly state: GraphState;
  readonly selected: string;
  readonly onSelect: (id: string | null) => void;
}

interface HeadingProps {
  readonly kind: string;
  readonly children: ComponentChildren;
}

export function Heading({ kind, children }: HeadingProps) {
  return (
    <header class="details-head">
      <p class="quiet small">{kind}</p>
      <h2>{children}</h2>
    </header>
  );
}

interface SectionProps {
  readonly title: string;
  readonly children: ComponentChildren;
}

export function Section({ title, children }: SectionProps) {
  return (
    <section class="details-section">
      <h3>{title}</h3>
      {children}
    </section>
  );
}

interface LinkProps {
  readonly id: string;
  readonly onSelect: (id: string) => void;
  readonly children: ComponentChildren;
}

/** A name that selects what it names. */
export function Link({ id, onSelect, children }: LinkProps) {
  return (
    <button type="button" class="link mono" onClick={() => onSelect(id)}>
      {children}
    </button>
  );
}

/** Panel: one view of the run, in the page or as an element of its own; what each is given, and how it is named. */
import type { ComponentType } from "preact";
import type { Session, Source } from "../store/session";

/** What a panel remembers in the layout: plain JSON. */
export type Settings = Readonly<Record<string, unknown>>;

export interface PanelProps {
  readonly session: Session;
  /** What this panel remembered; from an address, so each value is checked before it is used. */
  readonly settings: Settings;
  /** Remembers settings in the layout, in place of those before. */
  readonly onSettings: (settings: Settings) => void;
}

export interface Panel {
  /** Word in the layout, such as "plot". */
  readonly kind: string;
  readonly title: string;
  /** The sources that have something for it. */
  readonly sources: readonly Source[];
  /** What a server has to offer for it; nothing in particular where it is left out. */
  readonly capability?: string;
  readonly component: ComponentType<PanelProps>;
}

/** Workspace: the panels of the shown view, in columns. */
import type { Signal } from "@preact/signals";
import { Component, type ComponentChildren } from "preact";
import type { Panel } from "../panels/panel";
import { hasContent, PANELS } from "../panels/registry";
import type { Session, Source } from "../store/session";
import { errorText } from "../store/text";
import { Icon } from "../controls/icons";
import { removePanel, setSettings, shownIn, type Layout, type Place } from "./layout";

const BY_KIND: ReadonlyMap<string, Panel> = new Map(PANELS.map((panel) => [panel.kind, panel]));

interface WorkspaceProps {
  readonly session: Session;
  readonly layout: Signal<Layout>;
}

/** What stands in place of a panel that has nothing to show, as an address may name it. */
const ABSENT: Readonly<Record<Source, string>> = {
  run: "A run has nothing to show here.",
  recording: "A recording has nothing to show here.",
  bridge: "Only a run of busflow has something to show here.",
};

export function Workspace({ session, layout }: WorkspaceProps) {
  const columns = shownIn(layout.value);
  const isAlone = columns.flat().length === 1;
  const { view } = layout.value;
  return (
    <div class={`workspace ${isStale(session) ? "stale" : ""}`}>
      {columns.map((places, column) => (
        <div class="column" key={`${view} ${column}`}>
          {places.map((place, row) => (
            <PanelFrame
              key={`${view} ${column} ${row} ${place.kind}`}
              session={session}
              place={place}
              isAlone={isAlone}
              onSettings={(settings) => (layout.value = setSettings(layout.value, column, row, settings))}
              onClose={() => (layout.value = removePanel(layout.value, column, row))}
            />
          ))}
        </div>
      ))}
    </div>
  );
}

/** Whether the panels show what was, because the run has ended, hangs, or is out of reach. */
function isStale(session: Session): boolean {
  const run = session.run.value;
  return !session.isOpen.value || run?.ended !== undefined || run?.silent_s !== undefined;
}

interface FrameProps {
  readonly session: Session;
  readonly place: Place;
  readonly isAlone: boolean;
  readonly onSettings: (settings: Place["settings"]) => void;
  readonly onClose: () => void;
}

function PanelFrame({ session, place, isAlone, onSettings, onClose }: FrameProps) {
  const panel = BY_KIND.get(place.kind);
  if (panel === undefined) return null;
  const Body = panel.component;
  return (
    <section class="panel" aria-label={panel.title}>
      {isAlone ? (
        <h2 class="visually-hidden">{panel.title}</h2>
      ) : (
        <header class="panel-head">
          <h2>{panel.title}</h2>
          <button type="button" class="button plain icon" aria-label={`Close ${panel.title}`} onClick={onClose}>
            <Icon name="close" />
          </button>
        </header>
      )}
      <div class={`panel-body panel-${place.kind}`}>
        {hasContent(panel, session) ? (
          <Boundary title={panel.title}>
            <Body session={session} settings={place.settings} onSettings={onSettings} />
          </Boundary>
        ) : (
          <p class="empty">{session.server.value === null ? "Not connected" : ABSENT[session.source.value]}</p>
        )}
      </div>
    </section>
  );
}

interface BoundaryProps {
  readonly title: string;
  readonly children: ComponentChildren;
}

interface BoundaryState {
  readonly error: string | null;
}

/** Keeps an error of one panel from the others, and says it. */
class Boundary extends Component<BoundaryProps, BoundaryState> {
  override state: BoundaryState = { error: null };

  static override getDerivedStateFromError(error: unknown) {
    console.error(error);
    return { error: errorText(error) };
  }

  override render() {
    if (this.state.error === null) return this.props.children;
    return (
      <div class="empty" role="alert">
        <strong>{this.props.title} has failed</strong>
        <span>This is a mistake of the page: {this.state.error}</span>
        <button type="button" class="button" onClick={() => this.setState({ error: null })}>
          Try again
        </button>
      </div>
    );
  }
}

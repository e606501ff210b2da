/** The panels, in the order in which the page lists them. */
import { ActionsPanel } from "./actions/actions_panel";
import { FramesPanel } from "./frames/frames_panel";
import { GraphPanel } from "./graph/graph_panel";
import { HealthPanel } from "./health/health_panel";
import { Images } from "./images/images";
import { LogPanel } from "./log/log_panel";
import { Messages } from "./messages/messages";
import type { Session, Source } from "../store/session";
import { loadedPanel } from "./loaded_panel";
import type { Panel } from "./panel";
import { ParametersPanel } from "./parameters/parameters_panel";
import { ServicesPanel } from "./services/services_panel";
import { TeleopPanel } from "./teleop/teleop_panel";

const LIVE: readonly Source[] = ["run", "bridge"];
const ALL: readonly Source[] = [...LIVE, "recording"];

/** Its library alone takes as long to start as everything else. */
const Plot = loadedPanel(async () => (await import("./plot/plot")).Plot);

export const PANELS: readonly Panel[] = [
  { kind: "graph", title: "Graph", sources: ALL, component: GraphPanel },
  { kind: "plot", title: "Plot", sources: ALL, component: Plot },
  { kind: "messages", title: "Messages", sources: ALL, component: Messages },
  { kind: "images", title: "Images", sources: ALL, component: Images },
  { kind: "frames", title: "Frames", sources: ALL, component: FramesPanel },
  { kind: "parameters", title: "Parameters", sources: LIVE, capability: "parameters", component: ParametersPanel },
  { kind: "log", title: "Log", sources: ["run", "recording"], component: LogPanel },
  { kind: "services", title: "Services", sources: LIVE, component: ServicesPanel },
  { kind: "actions", title: "Actions", sources: ALL, component: ActionsPanel },
  { kind: "health", title: "Health", sources: ["run"], component: HealthPanel },
  { kind: "teleop", title: "Teleop", sources: LIVE, component: TeleopPanel },
];

/** Whether a panel has something to show of what the page looks at, as far as that is known yet. */
export function hasContent({ sources, capability }: Panel, { server, source }: Session): boolean {
  if (sources === ALL) return true;
  if (server.value === null || !sources.includes(source.value)) return false;
  return capability === undefined || server.value.capabilities.includes(capability);
}

/** Returns the panels that are offered; all of them until it is known what the page looks at. */
export function offeredPanels(session: Session): readonly Panel[] {
  return session.server.value === null ? PANELS : PANELS.filter((panel) => hasContent(panel, session));
}

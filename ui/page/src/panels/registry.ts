/** The panels, in the order in which the page lists them. */
import { ActionsPanel } from "./actions/actions_panel";
import { GraphPanel } from "./graph/graph_panel";
import { HealthPanel } from "./health/health_panel";
import { Images } from "./images/images";
import { LogPanel } from "./log/log_panel";
import { Messages } from "./messages/messages";
import type { Panel } from "./panel";
import { ParametersPanel } from "./parameters/parameters_panel";
import { Plot } from "./plot/plot";
import { ServicesPanel } from "./services/services_panel";
import { TeleopPanel } from "./teleop/teleop_panel";

export const PANELS: readonly Panel[] = [
  { kind: "graph", title: "Graph", component: GraphPanel },
  { kind: "plot", title: "Plot", component: Plot },
  { kind: "messages", title: "Messages", component: Messages },
  { kind: "images", title: "Images", component: Images },
  { kind: "parameters", title: "Parameters", component: ParametersPanel },
  { kind: "log", title: "Log", component: LogPanel },
  { kind: "services", title: "Services", component: ServicesPanel },
  { kind: "actions", title: "Actions", component: ActionsPanel },
  { kind: "health", title: "Health", component: HealthPanel },
  { kind: "teleop", title: "Teleop", component: TeleopPanel },
];

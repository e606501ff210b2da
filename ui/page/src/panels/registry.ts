/** The panels, in the order in which the page lists them. */
import { GraphPanel } from "./graph/graph_panel";
import type { Panel } from "./panel";
import { ParametersPanel } from "./parameters/parameters_panel";

export const PANELS: readonly Panel[] = [
  { kind: "graph", title: "Graph", component: GraphPanel },
  { kind: "parameters", title: "Parameters", component: ParametersPanel },
];

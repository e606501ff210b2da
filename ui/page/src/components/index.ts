/** The elements that a page of another origin may use: one script tag, then `<busflow-…>` with `server` and `token`. */

import { GraphPanel } from "../panels/graph/graph_panel";
import { LogPanel } from "../panels/log/log_panel";
import { ParametersPanel } from "../panels/parameters/parameters_panel";
import { OneParameter } from "../panels/parameters/one_parameter";
import { Plot } from "../panels/plot/plot";
import { linesOfField } from "../plots/settings";
import { define } from "./element";

define("busflow-graph", { component: GraphPanel, attributes: [], settingsOf: () => ({}) });
define("busflow-log", { component: LogPanel, attributes: [], settingsOf: () => ({}) });
define("busflow-parameters", { component: ParametersPanel, attributes: ["node"], settingsOf: ({ node }) => (node === undefined ? {} : { node }) });
define("busflow-parameter", {
  component: OneParameter,
  attributes: ["node", "name"],
  settingsOf: ({ node, name }) => ({ node: node ?? "", name: name ?? "" }),
});
define("busflow-plot", {
  component: Plot,
  attributes: ["topic", "field"],
  settingsOf: ({ topic, field }) => ({ lines: topic === undefined || field === undefined ? [] : linesOfField(topic, field) }),
});

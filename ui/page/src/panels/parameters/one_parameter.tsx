/** One parameter of a node by itself, such as beside the sentence of a text about it. */
import type { PanelProps } from "../panel";
import { ParameterForm } from "./parameter_form";

export function OneParameter({ session, settings }: PanelProps) {
  const { node, name } = settings;
  if (typeof node !== "string" || typeof name !== "string") return null;
  return (
    <div class="one-parameter">
      <ParameterForm session={session} node={node} matches={(parameter) => parameter.name === name} />
    </div>
  );
}

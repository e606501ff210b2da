/** Save parameters: writes what was changed into the launch file, after the edit was shown. */
import { SaveEdit } from "../../controls/save_edit";
import type { Session } from "../../store/session";

interface SaveProps {
  readonly session: Session;
  /** The node whose parameters are saved; all with null. */
  readonly node: string | null;
}

export function SaveParameters({ session, node }: SaveProps) {
  const nodes = node === null ? {} : { nodes: [node] };
  return (
    <SaveEdit
      label="Save into the launch file…"
      ask={(isDryRun) => session.questions.ask("save_parameters", { ...nodes, dry_run: isDryRun })}
    />
  );
}

/** Actions panel: the actions of the run, for the chosen one a form that sends a goal, and its goals with their states. */
import { Chooser, type Choice } from "../../controls/chooser";
import { SearchField } from "../../controls/search_field";
import type { Channel } from "../../connection/protocol";
import { matcher } from "../../store/search";
import type { Session } from "../../store/session";
import type { PanelProps } from "../panel";
import { FEEDBACK, GoalList, STATUS } from "./goal_list";
import { GoalForm } from "./goal_form";
import "./actions.css";

export function ActionsPanel({ session, settings, onSettings }: PanelProps) {
  const all = actionsOf(session.topics.channels.value);
  const search = typeof settings.search === "string" ? settings.search : "";
  const matches = matcher(search);
  const shown = all.filter(({ name }) => matches(name));
  const wanted = typeof settings.action === "string" ? settings.action : shown.length === 1 ? shown[0]?.name : undefined;
  const chosen = all.find(({ name }) => name === wanted);
  return (
    <>
      <div class="toolbar">
        <SearchField label="Search actions" value={search} onSearch={(text) => onSettings({ ...settings, search: text })} />
      </div>
      <Chooser
        label="Actions"
        choices={shown}
        chosen={wanted}
        onChoose={(action) => onSettings({ ...settings, action })}
        empty="No actions"
      >
        {wanted !== undefined && (
          <>
            <h3 class="mono">{wanted}</h3>
            <p class="quiet small mono">{chosen?.type ?? "It has no server now."}</p>
            <SendGoal key={`form ${wanted}`} session={session} action={wanted} hasServer={chosen !== undefined} />
            <GoalList key={`goals ${wanted}`} session={session} action={wanted} hasServer={chosen !== undefined} />
          </>
        )}
        {wanted === undefined && shown.length > 0 && <p class="empty">Choose an action to send it a goal.</p>}
      </Chooser>
    </>
  );
}

/** Returns the actions by their topics, which a recording and other servers have too. */
function actionsOf(channels: ReadonlyMap<string, Channel>): readonly Choice[] {
  return [...channels.keys()]
    .filter((topic) => topic.endsWith(STATUS))
    .map((topic) => topic.slice(0, -STATUS.length))
    .map((name) => ({ name, type: channels.get(name + FEEDBACK)?.schemaName.replace(/_FeedbackMessage$/, "") ?? "" }))
    .sort((one, other) => one.name.localeCompare(other.name));
}

interface SendProps {
  readonly session: Session;
  readonly action: string;
  readonly hasServer: boolean;
}

function SendGoal({ session, action, hasServer }: SendProps) {
  if (!session.isOpen.value) return null;
  if (session.source.value === "recording") return <p class="quiet goal-note">A recording shows goals, and takes none.</p>;
  if (!session.maySteer.value) return <p class="quiet goal-note">This page may only look: it sends no goals.</p>;
  if (!session.answersQuestions.value) return <p class="quiet goal-note">This page sends goals to runs of busflow only.</p>;
  return hasServer ? <GoalForm session={session} action={action} /> : null;
}

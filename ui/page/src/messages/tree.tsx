/** Message tree: the last message of a topic, live; its numbers can be dragged into a plot. */

import { useState } from "preact/hooks";
import type { TargetedKeyboardEvent } from "preact";
import { drag, plot } from "../plots/dragging";
import { useFollowed, useFrames } from "../plots/hooks";
import { observationOf } from "../plots/observation";
import type { Session } from "../store/session";
import { rateText } from "../store/text";
import { jsonText } from "./json";
import type { Received } from "./receiver";
import { FIRST_ITEMS, isSearch, rowsOf, type Row, type Shown } from "./rows";
import { stampText } from "./stamps";
import "./tree.css";

const MORE_ITEMS = 100;

interface Props {
  readonly session: Session;
  readonly topic: string;
  /** Words that must occur in what is shown of the message. */
  readonly search?: string;
}

export function MessageTree({ session, topic, search = "" }: Props) {
  const observation = observationOf(session);
  const [opened, setOpened] = useState<Shown>({ toggled: new Set(), items: new Map() });
  useFollowed(observation, [topic]);
  useFrames(observation);
  const isPast = observation.receiver.moment.value !== undefined;
  const isLive = !isPast && session.source.value !== "recording";
  const received = observation.receiver.shown(topic);
  if (received === undefined) return <p class="tree-nothing quiet">{isLive ? "No message has come yet." : "No message up to this moment."}</p>;
  const { reading } = received;
  return (
    <div class="message-tree">
      <TreeHead received={received} rateHz={isPast ? undefined : observation.receiver.rateHz(topic)} />
      {reading.fault === undefined ? (
        <Rows
          topic={topic}
          rows={rowsOf(reading.message, { ...opened, search })}
          onOpen={(row) => {
            if (row.kind === "rest") setOpened(withMore(opened, row));
            else if (!isSearch({ ...opened, search })) setOpened(withToggled(opened, row)); // a search has all branches open
          }}
        />
      ) : (
        <p class="tree-nothing bad" role="alert">
          {reading.fault}
        </p>
      )}
    </div>
  );
}

function withToggled(shown: Shown, { path }: Row): Shown {
  const toggled = new Set(shown.toggled);
  if (!toggled.delete(path)) toggled.add(path);
  return { ...shown, toggled };
}

function withMore(shown: Shown, { path }: Row): Shown {
  const array = path.replace(/\[…\]$/, "");
  return { ...shown, items: new Map(shown.items).set(array, (shown.items.get(array) ?? FIRST_ITEMS) + MORE_ITEMS) };
}

interface HeadProps {
  readonly received: Received;
  readonly rateHz: number | undefined;
}

function TreeHead({ received, rateHz }: HeadProps) {
  const [copied, setCopied] = useState("");
  const { reading, frame, stampNs } = received;
  const copy = async (): Promise<void> => {
    if (reading.fault !== undefined) return;
    try {
      await navigator.clipboard.writeText(jsonText(reading.message, 2));
      setCopied("copied");
    } catch {
      setCopied("this browser allows no copying here");
    }
    setTimeout(() => setCopied(""), 2000);
  };
  return (
    <div class="tree-head small">
      <span class="quiet">{frame.channel.schemaName}</span>
      <span class="mono">{stampText(stampNs, 3)}</span>
      {rateHz !== undefined && <span class="mono">{rateText(rateHz)}</span>}
      <span class="quiet tree-copied" role="status">
        {copied}
      </span>
      <button type="button" class="button plain" disabled={reading.fault !== undefined} onClick={() => void copy()}>
        Copy
      </button>
    </div>
  );
}

interface RowsProps {
  readonly topic: string;
  readonly rows: readonly Row[];
  readonly onOpen: (row: Row) => void;
}

function Rows({ topic, rows, onOpen }: RowsProps) {
  const [active, setActive] = useState("");
  if (rows.length === 0) return <p class="tree-nothing quiet">No field matches.</p>;
  const current = rows.some((row) => row.path === active) ? active : (rows[0]?.path ?? "");
  const act = (row: Row, from: EventTarget): void => {
    if (row.kind === "number") plot(from, { topic, field: row.path });
    else if (row.kind !== "text") onOpen(row);
  };
  return (
    <div
      class="tree"
      role="tree"
      aria-label={`Message of ${topic}`}
      onKeyDown={(event) => onTreeKey(event, { rows, current, onAct: (row) => act(row, event.currentTarget), onMove: setActive })}
    >
      {rows.map((row) => (
        <TreeRow
          key={row.path}
          row={row}
          topic={topic}
          isActive={row.path === current}
          onAct={(from) => {
            setActive(row.path);
            act(row, from);
          }}
        />
      ))}
    </div>
  );
}

interface TreeRowProps {
  readonly row: Row;
  readonly topic: string;
  readonly isActive: boolean;
  readonly onAct: (from: EventTarget) => void;
}

function TreeRow({ row, topic, isActive, onAct }: TreeRowProps) {
  const isNumber = row.kind === "number";
  const isClosed = row.kind === "branch" && !row.isOpen;
  return (
    <div
      class={`tree-row ${row.kind}`}
      role="treeitem"
      aria-level={row.depth}
      aria-expanded={row.kind === "branch" ? row.isOpen : undefined}
      aria-selected={isActive}
      tabIndex={isActive ? 0 : -1}
      style={{ paddingLeft: `${row.depth * 14}px` }}
      draggable={isNumber}
      title={isNumber ? "Plot it: click, or drag it into a plot" : undefined}
      onDragStart={(event) => event.dataTransfer && drag(event.dataTransfer, { topic, field: row.path })}
      onClick={(event) => onAct(event.currentTarget)}
    >
      <span class="tree-mark" aria-hidden="true">
        {row.kind === "branch" ? (isClosed ? "▸" : "▾") : ""}
      </span>
      <span class="tree-name">{row.name}</span> <span class="tree-value mono">{row.text}</span>
    </div>
  );
}

interface TreeKeys {
  readonly rows: readonly Row[];
  /** Path of the row that has the focus. */
  readonly current: string;
  readonly onAct: (row: Row) => void;
  readonly onMove: (path: string) => void;
}

/** Moves through the rows with the arrow keys; Enter opens a branch, and plots a number. */
function onTreeKey(event: TargetedKeyboardEvent<HTMLElement>, { rows, current, onAct, onMove }: TreeKeys): void {
  const at = rows.findIndex((row) => row.path === current);
  const row = rows[at];
  if (row === undefined) return;
  const elements = event.currentTarget.querySelectorAll<HTMLElement>("[role=treeitem]");
  const moveTo = (next: number): void => {
    const target = Math.max(0, Math.min(rows.length - 1, next));
    onMove(rows[target]?.path ?? current);
    elements[target]?.focus();
  };
  const keys: Readonly<Record<string, () => void>> = {
    ArrowDown: () => moveTo(at + 1),
    ArrowUp: () => moveTo(at - 1),
    Home: () => moveTo(0),
    End: () => moveTo(rows.length - 1),
    ArrowRight: () => (row.kind === "branch" && !row.isOpen ? onAct(row) : moveTo(at + 1)),
    ArrowLeft: () => (row.isOpen ? onAct(row) : moveTo(rows.findLastIndex((each, index) => index < at && each.depth < row.depth))),
    Enter: () => onAct(row),
    " ": () => onAct(row),
  };
  const action = keys[event.key];
  if (action === undefined) return;
  event.preventDefault();
  action();
}

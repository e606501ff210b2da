/** Log panel: the log of the run, what was kept first, filtered by level, node and text. */
import { useSignal } from "@preact/signals";
import { useLayoutEffect, useRef } from "preact/hooks";
import { SearchField } from "../../controls/search_field";
import type { LogEntry, Session } from "../../store/session";
import { clockText, counted } from "../../store/text";
import type { PanelProps, Settings } from "../panel";
import { filtered, LEVELS, levelWord, nodesOf, type LogFilter } from "./filter";
import "./log.css";

/** Most lines that are drawn; a search looks through all that are kept. */
const MOST_SHOWN = 1000;
const USUAL_LEVEL = 20;

function readFilter({ level, node, text }: Settings): LogFilter {
  return {
    level: LEVELS.some(([number]) => number === level) ? Number(level) : USUAL_LEVEL,
    node: typeof node === "string" ? node : "",
    text: typeof text === "string" ? text : "",
  };
}

export function LogPanel({ session, settings, onSettings }: PanelProps) {
  const filter = readFilter(settings);
  const all = session.log.value;
  const found = filtered(all, filter);
  const shown = found.slice(-MOST_SHOWN);
  const change = (changed: Partial<LogFilter>) => onSettings({ ...settings, ...changed });
  return (
    <>
      <div class="toolbar">
        <SearchField label="Search the log" value={filter.text} onSearch={(text) => change({ text })} />
        <select
          aria-label="Level"
          value={filter.level}
          onChange={(event) => change({ level: Number(event.currentTarget.value) })}
        >
          {LEVELS.map(([number, word]) => (
            <option key={number} value={number}>
              {word} and above
            </option>
          ))}
        </select>
        <select aria-label="Node" value={filter.node} onChange={(event) => change({ node: event.currentTarget.value })}>
          <option value="">All nodes</option>
          {[...new Set([...nodesOf(all), filter.node])].filter(Boolean).map((node) => (
            <option key={node}>{node}</option>
          ))}
        </select>
        <span class="grow" />
        <span class="quiet">{sumOf(all.length, found.length, shown.length)}</span>
      </div>
      {shown.length === 0 ? (
        <p class="empty">{all.length === 0 ? nothingText(session) : "No line matches."}</p>
      ) : (
        <Lines lines={shown} onNode={(node) => change({ node })} />
      )}
    </>
  );
}

function nothingText({ source }: Session): string {
  return source.value === "recording" ? "Nothing has been logged up to this moment." : "Nothing has been logged.";
}

function sumOf(all: number, found: number, shown: number): string {
  const last = shown < found ? `the last ${shown} of ` : "";
  return found === all ? `${last}${counted(all, "line")}` : `${last}${found} of ${counted(all, "line")}`;
}

interface LinesProps {
  readonly lines: readonly LogEntry[];
  readonly onNode: (node: string) => void;
}

/** The lines, whose end stays in view until the person scrolls up. */
function Lines({ lines, onNode }: LinesProps) {
  const frame = useRef<HTMLDivElement>(null);
  const isAtEnd = useSignal(true);
  useLayoutEffect(() => {
    const element = frame.current;
    if (element !== null && isAtEnd.value) element.scrollTop = element.scrollHeight;
  });
  const onScroll = () => {
    const element = frame.current;
    if (element !== null) isAtEnd.value = element.scrollHeight - element.scrollTop - element.clientHeight < 24;
  };
  return (
    <div class="log">
      <div ref={frame} class="log-lines" role="log" aria-live="off" tabIndex={0} aria-label="Log" onScroll={onScroll}>
        {lines.map((line) => (
          <Line key={line.key} line={line} onNode={onNode} />
        ))}
      </div>
      {!isAtEnd.value && (
        <button type="button" class="button log-end" onClick={() => (isAtEnd.value = true)}>
          Go to the newest
        </button>
      )}
    </div>
  );
}

function Line({ line, onNode }: { readonly line: LogEntry; readonly onNode: (node: string) => void }) {
  const word = levelWord(line.level);
  return (
    <div class={`log-line ${word}`}>
      <time class="quiet" dateTime={new Date(line.stamp_ns / 1e6).toISOString()}>
        {clockText(line.stamp_ns)}
      </time>
      <span class="log-level">{word}</span>
      <button type="button" class="log-node" title={`Only ${line.node}`} onClick={() => onNode(line.node)}>
        {line.node}
      </button>
      <span class="log-text">{line.text}</span>
    </div>
  );
}

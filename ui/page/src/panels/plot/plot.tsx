/** Plot: numbers of any topics over time. */

import { useCallback, useEffect, useRef, useState } from "preact/hooks";
import type { ComponentChildren, RefObject, TargetedKeyboardEvent } from "preact";
import { Chart } from "../../plots/chart";
import { csvOf } from "../../plots/csv";
import { dropped, isField } from "../../plots/dragging";
import { FieldInput } from "../../plots/field_input";
import { useOpened, useThemeChange, type Opened } from "../../plots/hooks";
import type { Line } from "../../plots/lines";
import { observationOf, type Observation } from "../../plots/observation";
import { linesOf, withLine, withoutLine } from "../../plots/settings";
import { SPANS_S, type Stretch, type Timeline } from "../../plots/timeline";
import type { RecordingTime } from "../../connection/answers";
import type { Session } from "../../store/session";
import type { PanelProps } from "../panel";
import { Legend } from "./legend";

const WHOLE = "whole";

export function Plot({ session, settings, onSettings }: PanelProps) {
  const observation = observationOf(session);
  const opened = useOpened(observation, linesOf(settings));
  const [hoverS, setHover] = useState<number>();
  const host = useRef<HTMLDivElement | null>(null);
  const chart = useChart(host, observation, opened, setHover);
  const add = (address: string): void => onSettings(withLine(settings, address));
  return (
    <DropTarget onField={add}>
      <div class="toolbar">
        <FieldInput session={session} onField={add} />
        <PlotTools session={session} observation={observation} opened={opened} chart={chart} />
      </div>
      <div class="plot-drawing">
        <Drawing host={host} chart={chart} observation={observation} opened={opened} />
        {opened.length === 0 && (
          <div class="empty plot-empty">
            <strong>No line yet</strong>
            <span>Type a field above, or drag a number here from Messages.</span>
          </div>
        )}
      </div>
      <Legend
        session={session}
        observation={observation}
        opened={opened}
        hoverS={hoverS}
        onRemove={(text) => onSettings(withoutLine(settings, text))}
      />
    </DropTarget>
  );
}

interface DropTargetProps {
  readonly onField: (address: string) => void;
  readonly children: ComponentChildren;
}

/** Takes a number that is dragged from a message. */
function DropTarget({ onField, children }: DropTargetProps) {
  const [isTarget, setTarget] = useState(false);
  return (
    <div
      class={`plot${isTarget ? " target" : ""}`}
      onDragOver={(event) => {
        if (!isField(event.dataTransfer)) return;
        event.preventDefault();
        setTarget(true);
      }}
      onDragLeave={() => setTarget(false)}
      onDrop={(event) => {
        setTarget(false);
        if (!isField(event.dataTransfer)) return;
        event.preventDefault();
        const address = dropped(event.dataTransfer);
        if (address !== undefined) onField(address);
      }}
    >
      {children}
    </div>
  );
}

interface DrawingProps {
  readonly host: RefObject<HTMLDivElement | null>;
  readonly chart: RefObject<Chart | null>;
  readonly observation: Observation;
  readonly opened: readonly Opened[];
}

function Drawing({ host, chart, observation, opened }: DrawingProps) {
  const { timeline, frames } = observation;
  return (
    <div
      ref={host}
      class="plot-host"
      role="group"
      tabIndex={0}
      aria-label={`Plot of ${opened.length === 0 ? "nothing yet" : opened.map((each) => each.text).join(", ")}`}
      aria-description="Arrow keys move cursor A, with Shift cursor B; plus and minus zoom, 0 shows the newest, Space pauses."
      onKeyDown={(event) => onKey(event, chart.current, observation)}
      onClick={(event) => {
        const timeS = chart.current?.momentAt(event.clientX);
        if (timeS === undefined) return;
        timeline.putCursor(event.shiftKey ? 1 : 0, timeS);
        frames.request();
      }}
      onDblClick={() => {
        timeline.show(undefined);
        timeline.clearCursors();
        frames.request();
      }}
    />
  );
}

function openLines(opened: readonly Opened[]): Line[] {
  return opened.flatMap((each) => ("line" in each ? [each.line] : []));
}

function useChart(
  host: RefObject<HTMLDivElement | null>,
  observation: Observation,
  opened: readonly Opened[],
  onHover: (timeS: number | undefined) => void,
): RefObject<Chart | null> {
  const chart = useRef<Chart | null>(null);
  useEffect(() => {
    if (host.current === null) return undefined;
    const made = new Chart(host.current, observation, onHover);
    chart.current = made;
    const end = observation.frames.listen(() => made.draw());
    return () => {
      end();
      made.destroy();
      chart.current = null;
    };
  }, [host, observation, onHover]);
  useEffect(() => chart.current?.setLines(openLines(opened)), [opened]);
  useThemeChange(useCallback(() => chart.current?.restyle(), []));
  return chart;
}

interface ToolsProps {
  readonly session: Session;
  readonly observation: Observation;
  readonly opened: readonly Opened[];
  readonly chart: RefObject<Chart | null>;
}

function PlotTools({ session, observation, opened, chart }: ToolsProps) {
  const { timeline } = observation;
  const time = session.source.value === "recording" ? session.time.value : null;
  const isPaused = timeline.isPaused.value;
  const saveCsv = (): void => {
    const columns = openLines(opened).map(({ text, unit, points }) => ({ name: text, unit, points }));
    const stretch = chart.current?.stretch;
    if (stretch !== undefined) save(new Blob([csvOf(columns, stretch, (timeS) => timeline.stampOf(timeS))], { type: "text/csv" }), "plot.csv");
  };
  const savePng = async (): Promise<void> => {
    const picture = await chart.current?.png(({ text, unit }) => (unit === undefined ? text : `${text}, ${unit}`));
    if (picture !== undefined) save(picture, "plot.png");
  };
  return (
    <>
      <label class="small quiet span-choice">
        {timeline.whole.value === undefined ? "Last" : "Shown"}{" "}
        <select
          value={timeline.whole.value === undefined ? timeline.spanS.value : WHOLE}
          onChange={(event) => {
            const { value } = event.currentTarget;
            timeline.show(undefined);
            timeline.whole.value = value === WHOLE && time !== null ? wholeOf(time, timeline) : undefined;
            if (value !== WHOLE) timeline.spanS.value = Number(value);
            observation.frames.request();
          }}
        >
          {SPANS_S.map((each) => (
            <option key={each} value={each}>
              {each} s
            </option>
          ))}
          {time !== null && <option value={WHOLE}>whole recording</option>}
        </select>
      </label>
      <button type="button" class="button" aria-pressed={isPaused} onClick={() => observation.toggle()}>
        {isPaused ? "Resume" : "Pause"}
      </button>
      <button type="button" class="button" disabled={opened.length === 0} onClick={saveCsv}>
        CSV
      </button>
      <button type="button" class="button" disabled={opened.length === 0} onClick={() => void savePng()}>
        PNG
      </button>
    </>
  );
}

/** Returns the stretch of a whole recording; one of a single moment has a second. */
function wholeOf({ start_ns: startNs, end_ns: endNs }: RecordingTime, timeline: Timeline): Stretch {
  const from = timeline.secondsOf(BigInt(startNs));
  return { from, to: Math.max(from + 1e-3, timeline.secondsOf(BigInt(endNs))) };
}

function save(blob: Blob, name: string): void {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

function onKey(event: TargetedKeyboardEvent<HTMLElement>, chart: Chart | null, observation: Observation): void {
  const { timeline } = observation;
  if (chart === null || event.ctrlKey || event.metaKey || event.altKey) return;
  const { from, to } = chart.stretch;
  const steps: Readonly<Record<string, () => void>> = {
    ArrowLeft: () => moveCursor(event.shiftKey ? 1 : 0, -1),
    ArrowRight: () => moveCursor(event.shiftKey ? 1 : 0, 1),
    "+": () => zoomTo((to - from) / 2),
    "-": () => zoomTo((to - from) * 2),
    "0": () => timeline.show(undefined),
    Escape: () => timeline.clearCursors(),
    " ": () => observation.toggle(),
  };
  const moveCursor = (which: 0 | 1, direction: number): void => {
    const at = timeline.cursors.peek()[which] ?? (from + to) / 2;
    timeline.putCursor(which, Math.min(to, Math.max(from, at + (direction * (to - from)) / 100)));
  };
  const zoomTo = (widthS: number): void => {
    if (!timeline.isPaused.peek()) observation.pause();
    const middle = timeline.cursors.peek()[0] ?? (from + to) / 2;
    timeline.show({ from: middle - widthS / 2, to: middle + widthS / 2 });
  };
  const step = steps[event.key];
  if (step === undefined) return;
  event.preventDefault();
  step();
  observation.frames.request();
}

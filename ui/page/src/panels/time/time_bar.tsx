/** Time bar: the moment that all panels show: of a run in its last 60 s, of a recording anywhere. */

import { useMemo, useState } from "preact/hooks";
import type { TargetedKeyboardEvent } from "preact";
import type { RecordingTime } from "../../connection/answers";
import { stampText } from "../../messages/stamps";
import { KEPT_NS } from "../../messages/receiver";
import { useFrames } from "../../plots/hooks";
import { observationOf } from "../../plots/observation";
import type { Session } from "../../store/session";
import { durationText, errorText } from "../../store/text";
import { RecordButton } from "./record_button";
import { Seeking } from "./seeking";
import "./time_bar.css";

const RATES = [0.1, 0.25, 0.5, 1, 2, 5, 10] as const;
const MS_NS = 1_000_000n;
const STEP_MS = 1000;

interface Props {
  readonly session: Session;
}

export function TimeBar({ session }: Props) {
  return session.source.value === "recording" ? <RecordingBar session={session} /> : <LiveBar session={session} />;
}

function LiveBar({ session }: Props) {
  const observation = observationOf(session);
  const { receiver, timeline } = observation;
  useFrames(observation);
  const isPaused = timeline.isPaused.value;
  const moment = receiver.moment.value;
  const isFollowing = receiver.isFollowing.value;
  const newest = isPaused ? timeline.stampOf(timeline.pausedS.value ?? 0) : isFollowing ? receiver.latestNs : undefined;
  const oldest = newest === undefined ? 0n : newest - KEPT_NS;
  const at = moment ?? newest;
  const lookAt = (ms: number): void => observation.lookAt(oldest + BigInt(Math.round(ms)) * MS_NS);
  return (
    <section class="time-bar" aria-label="Time">
      <button type="button" class="button" aria-pressed={isPaused} disabled={newest === undefined} onClick={() => observation.toggle()}>
        {isPaused ? "Resume" : "Pause"}
      </button>
      <Scrubber label="Moment of the last 60 s" lengthMs={Number(KEPT_NS / MS_NS)} at={at} from={oldest} isOff={newest === undefined} onMove={lookAt} />
      {at === undefined ? (
        <span class="quiet small">{isFollowing ? "No message yet" : "No topic is shown"}</span>
      ) : (
        <>
          <span class="mono time-text">{stampText(at)}</span>
          <span class={isPaused ? "badge warn" : "badge"}>{isPaused ? "paused" : "live"}</span>
        </>
      )}
      {session.answersQuestions.value && session.source.value === "run" && <RecordButton session={session} />}
    </section>
  );
}

function RecordingBar({ session }: Props) {
  const time = session.time.value;
  const [fault, setFault] = useState("");
  const seeking = useMemo(
    () =>
      new Seeking(
        (seek) => session.questions.ask("seek", seek),
        (error) => setFault(errorText(error)),
      ),
    [session],
  );
  if (time === null) return null;
  const [start, end, at] = [BigInt(time.start_ns), BigInt(time.end_ns), BigInt(time.stamp_ns)];
  const { lines, timeline } = observationOf(session);
  const moveTo = (ms: number): void => {
    const stamp = clamp(start + BigInt(Math.round(ms)) * MS_NS, start, end);
    setFault("");
    lines.continueFrom(timeline.secondsOf(stamp));
    seeking.seek({ stamp_ns: String(stamp) });
  };
  const lengthMs = Number((end - start) / MS_NS);
  return (
    <section class="time-bar" aria-label="Time" onKeyDown={(event) => onBarKey(event, time, (ms) => moveTo(Number((at - start) / MS_NS) + ms), seeking)}>
      <button type="button" class="button primary" onClick={() => seeking.seek({ play: !time.playing })}>
        {time.playing ? "Pause" : "Play"}
      </button>
      <Scrubber label="Moment of the recording" lengthMs={lengthMs} at={at} from={start} isOff={false} onMove={moveTo} />
      <span class="mono time-text">{stampText(at)}</span>
      <span class="mono quiet">
        {durationText(Number((at - start) / MS_NS) / 1000)} / {durationText(lengthMs / 1000)}
      </span>
      <label class="small quiet">
        Rate{" "}
        <select value={time.rate} onChange={(event) => seeking.seek({ rate: Number(event.currentTarget.value) })}>
          {[...new Set([...RATES, time.rate])].map((rate) => (
            <option key={rate} value={rate}>
              {rate}×
            </option>
          ))}
        </select>
      </label>
      {fault !== "" && (
        <span class="bad" role="alert">
          {fault}
        </span>
      )}
    </section>
  );
}

interface ScrubberProps {
  readonly label: string;
  readonly lengthMs: number;
  readonly at: bigint | undefined;
  readonly from: bigint;
  readonly isOff: boolean;
  readonly onMove: (ms: number) => void;
}

function Scrubber({ label, lengthMs, at, from, isOff, onMove }: ScrubberProps) {
  return (
    <input
      class="scrubber"
      type="range"
      aria-label={label}
      aria-valuetext={at === undefined ? "nothing yet" : stampText(at)}
      min={0}
      max={lengthMs}
      step={10}
      disabled={isOff}
      value={at === undefined ? lengthMs : Number((at - from) / MS_NS)}
      onInput={(event) => onMove(Number(event.currentTarget.value))}
    />
  );
}

/** Moves by a second with an arrow key, by ten with Shift; Space plays and pauses. */
function onBarKey(event: TargetedKeyboardEvent<HTMLElement>, time: RecordingTime, moveBy: (ms: number) => void, seeking: Seeking): void {
  const isControl = event.target instanceof HTMLButtonElement || event.target instanceof HTMLSelectElement;
  if (isControl || event.ctrlKey || event.metaKey || event.altKey) return;
  const step = event.shiftKey ? 10 * STEP_MS : STEP_MS;
  if (event.key === "ArrowRight") moveBy(step);
  else if (event.key === "ArrowLeft") moveBy(-step);
  else if (event.key === " ") seeking.seek({ play: !time.playing });
  else return;
  event.preventDefault();
}

function clamp(value: bigint, least: bigint, greatest: bigint): bigint {
  return value < least ? least : value > greatest ? greatest : value;
}

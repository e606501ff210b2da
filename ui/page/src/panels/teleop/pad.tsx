/** Pad: held with the pointer or with keys, it moves the stick of a drive. */
import type { ReadonlySignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { isDriveKey, stickOf, type Drive, type Stick } from "./drive";

interface PadProps {
  /** Null while nothing is driven. */
  readonly drive: Drive | null;
  readonly stick: ReadonlySignal<Stick>;
  readonly isEnabled: boolean;
}

const SIZE = 220;
const KNOB = 28;
const REACH = SIZE / 2 - KNOB;

export function Pad({ drive, stick, isEnabled }: PadProps) {
  const pad = useRef<HTMLDivElement>(null);
  const keys = useRef(new Set<string>());
  useEffect(() => {
    if (drive === null) keys.current.clear();
    else pad.current?.focus();
  }, [drive]);
  const letGo = () => {
    keys.current.clear();
    drive?.release();
  };
  const follow = (event: PointerEvent) => {
    const element = pad.current;
    if (element?.hasPointerCapture(event.pointerId) === true) drive?.hold(stickAt(element, event));
  };
  const onKey = (event: KeyboardEvent, isDown: boolean) => {
    if (drive === null || !isDriveKey(event.code)) return;
    event.preventDefault();
    if (isDown) keys.current.add(event.code);
    else keys.current.delete(event.code);
    const held = stickOf(keys.current);
    if (held === null) drive.release();
    else drive.hold(held);
  };
  const { forward, left } = stick.value;
  return (
    <div
      ref={pad}
      class={`pad ${isEnabled ? "" : "off"}`}
      role="application"
      aria-label="Drive pad: hold it, or an arrow key"
      aria-disabled={!isEnabled}
      tabIndex={isEnabled ? 0 : -1}
      onPointerDown={(event) => {
        if (drive === null || event.button !== 0) return;
        pad.current?.setPointerCapture(event.pointerId);
        drive.hold(stickAt(event.currentTarget, event));
      }}
      onPointerMove={follow}
      onPointerUp={letGo}
      onPointerCancel={letGo}
      onLostPointerCapture={letGo}
      onKeyDown={(event) => onKey(event, true)}
      onKeyUp={(event) => onKey(event, false)}
      onBlur={letGo}
    >
      <svg viewBox={`0 0 ${SIZE} ${SIZE}`} aria-hidden="true">
        <circle class="pad-rim" cx={SIZE / 2} cy={SIZE / 2} r={SIZE / 2 - 1} />
        <path class="pad-cross" d={`M${SIZE / 2} 20V${SIZE - 20}M20 ${SIZE / 2}H${SIZE - 20}`} />
        <circle class="pad-knob" cx={SIZE / 2 - left * REACH} cy={SIZE / 2 - forward * REACH} r={KNOB} />
      </svg>
    </div>
  );
}

/** Returns the stick at a pointer: up is forward, and the middle is rest. */
function stickAt(element: HTMLElement, event: PointerEvent): Stick {
  const { left, top, width, height } = element.getBoundingClientRect();
  const reach = (REACH / SIZE) * width;
  return { forward: (top + height / 2 - event.clientY) / reach, left: (left + width / 2 - event.clientX) / reach };
}

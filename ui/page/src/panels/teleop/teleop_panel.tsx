/** Teleop panel: drives a robot with geometry_msgs/msg/Twist while its pad or a key is held. */
import { useSignal } from "@preact/signals";
import { useEffect, useMemo } from "preact/hooks";
import { counted } from "../../store/text";
import type { Session } from "../../store/session";
import type { PanelProps, Settings } from "../panel";
import { Drive, REST, twistBytes, type Stick } from "./drive";
import { Pad } from "./pad";
import "./teleop.css";

const TWIST = "geometry_msgs/msg/Twist";
const TOPIC_NAME = /^\/[A-Za-z_][\w/]*$/;

interface TeleopSettings {
  readonly topic: string;
  /** Greatest speeds, m/s and rad/s. */
  readonly linear: number;
  readonly angular: number;
}

function readSettings(settings: Settings, usualTopic: string): TeleopSettings {
  const speed = (value: unknown, usual: number, most: number): number =>
    typeof value === "number" && value > 0 && value <= most ? value : usual;
  return {
    topic: typeof settings.topic === "string" ? settings.topic : usualTopic,
    linear: speed(settings.linear, 0.5, 5),
    angular: speed(settings.angular, 1, 6),
  };
}

export function TeleopPanel({ session, settings, onSettings }: PanelProps) {
  const isOn = useSignal(false);
  const topics = [...session.topics.channels.value.values()].filter(({ schemaName }) => schemaName === TWIST);
  const chosen = readSettings(settings, topics[0]?.topic ?? "/cmd_vel");
  const isTopic = TOPIC_NAME.test(chosen.topic);
  const maySteer = session.maySteer.value;
  const isDriving = isOn.value && maySteer && isTopic;
  const { drive, stick } = useDrive(session, chosen, isDriving);
  if (!maySteer && session.isOpen.value) return <p class="empty">This page may only look: it does not drive.</p>;
  const change = (changed: Partial<TeleopSettings>) => onSettings({ ...settings, ...changed });
  return (
    <div class="scroll">
      <div class="teleop">
        <div class="teleop-settings">
          <label htmlFor="teleop-topic">Topic</label>
          <input
            id="teleop-topic"
            class="field mono"
            list="teleop-topics"
            value={chosen.topic}
            disabled={isOn.value}
            aria-invalid={!isTopic}
            onChange={(event) => change({ topic: event.currentTarget.value })}
          />
          <datalist id="teleop-topics">
            {topics.map(({ topic }) => (
              <option key={topic} value={topic} />
            ))}
          </datalist>
          <Speed label="Forward" unit="m/s" most={5} value={chosen.linear} onChange={(linear) => change({ linear })} />
          <Speed label="Turning" unit="rad/s" most={6} value={chosen.angular} onChange={(angular) => change({ angular })} />
        </div>
        <button
          type="button"
          class={`button ${isOn.value ? "" : "primary"}`}
          aria-pressed={isOn.value}
          disabled={!isTopic || !maySteer}
          onClick={() => (isOn.value = !isOn.value)}
        >
          {isOn.value ? "Stop driving" : "Drive"}
        </button>
        <Pad drive={drive} stick={stick} isEnabled={isDriving} />
        <p class="quiet" role="status">
          {isDriving ? <Sent session={session} topic={chosen.topic} stick={stick.value} speeds={chosen} /> : HELP}
        </p>
      </div>
    </div>
  );
}

const HELP = "It publishes only while the pad, an arrow key or W, A, S, D is held, and zero as soon as you let go.";

/** The drive of a topic, and its stick; it is let go whenever the page cannot be sure that it is still held. */
function useDrive(session: Session, { topic, linear, angular }: TeleopSettings, isDriving: boolean) {
  const stick = useSignal<Stick>(REST);
  const speeds = useSignal({ linear, angular });
  speeds.value = { linear, angular };
  const drive = useMemo(() => {
    if (!isDriving) return null;
    const publication = session.topics.advertise({ topic, encoding: "cdr", schemaName: TWIST });
    const made = new Drive((now) => {
      stick.value = now;
      publication.publish(twistBytes(now.forward * speeds.peek().linear, now.left * speeds.peek().angular));
    });
    return { drive: made, publication };
  }, [session, topic, isDriving, stick, speeds]);
  useEffect(() => {
    if (drive === null) return undefined;
    const release = () => drive.drive.release();
    const ending = new AbortController();
    addEventListener("blur", release, { signal: ending.signal });
    addEventListener("pagehide", release, { signal: ending.signal });
    document.addEventListener("visibilitychange", release, { signal: ending.signal });
    const stopWatching = session.isOpen.subscribe((isOpen) => {
      if (!isOpen) release();
    });
    return () => {
      ending.abort();
      stopWatching();
      drive.drive.end();
      drive.publication.end();
    };
  }, [drive, session]);
  return { drive: drive?.drive ?? null, stick };
}

interface SpeedProps {
  readonly label: string;
  readonly unit: string;
  readonly most: number;
  readonly value: number;
  readonly onChange: (value: number) => void;
}

function Speed({ label, unit, most, value, onChange }: SpeedProps) {
  const id = `teleop-${label}`;
  return (
    <>
      <label htmlFor={id}>{label}</label>
      <span class="teleop-speed">
        <input
          id={id}
          type="range"
          min={0.05}
          max={most}
          step={0.05}
          value={value}
          onInput={(event) => onChange(event.currentTarget.valueAsNumber)}
        />
        <output htmlFor={id}>
          {value.toFixed(2)} <span class="quiet">{unit}</span>
        </output>
      </span>
    </>
  );
}

interface SentProps {
  readonly session: Session;
  readonly topic: string;
  readonly stick: Stick;
  readonly speeds: TeleopSettings;
}

/** What is sent now, and how many receive it. */
function Sent({ session, topic, stick, speeds }: SentProps) {
  const found = session.graph.value?.graph.topics.find(({ name }) => name === topic);
  const receivers = new Set(found?.subscriptions.map(({ node }) => node)).size;
  return (
    <>
      {(stick.forward * speeds.linear).toFixed(2)} m/s, {(stick.left * speeds.angular).toFixed(2)} rad/s ·{" "}
      {receivers === 0 ? <span class="bad">no node receives {topic}</span> : `received by ${counted(receivers, "node")}`}
    </>
  );
}

/** Frames panel: the tree of frames, as `busflow tf tree` draws it, with where each is seen from its parent. */
import { useEffect, useMemo, useRef } from "preact/hooks";
import type { Received, Receiver } from "../../messages/receiver";
import { useFrames } from "../../plots/hooks";
import { observationOf, type Observation } from "../../plots/observation";
import { rateText } from "../../store/text";
import type { PanelProps } from "../panel";
import { FrameTree, rateOf, type Frame, type FrameRow } from "./frame_tree";
import "./frames.css";

const [MOVING, FIXED] = ["/tf", "/tf_static"];
/** Most messages before a moment that are looked through for the frames at it. */
const MOST_BEFORE = 500;
const PER_DEPTH_PX = 18;

export function FramesPanel({ session }: PanelProps) {
  const observation = observationOf(session);
  const rows = useTree(observation, session.isOpen.value).rows();
  if (rows.length === 0) {
    return (
      <div class="empty">
        <strong>No frames</strong>
        <span>
          They appear here as soon as a transform comes on {MOVING} or {FIXED}.
        </span>
      </div>
    );
  }
  return (
    <div class="scroll frames" tabIndex={0} role="region" aria-label="Frames">
      <table class="table">
        <thead>
          <tr>
            <th scope="col">frame</th>
            <th scope="col" class="number">
              rate
            </th>
            <th scope="col" class="number" colSpan={3}>
              x, y, z in m
            </th>
            <th scope="col" class="number" colSpan={3}>
              roll, pitch, yaw in °
            </th>
          </tr>
        </thead>
        <tbody>
          {rows.map((row) => (
            <Row key={row.name} row={row} />
          ))}
        </tbody>
      </table>
    </div>
  );
}

function Row({ row: { name, depth, frame } }: { readonly row: FrameRow }) {
  return (
    <tr>
      <th scope="row" class="frame-name" style={{ paddingLeft: `${depth * PER_DEPTH_PX}px` }}>
        {depth > 0 && (
          <span class="quiet" aria-hidden="true">
            └{" "}
          </span>
        )}
        <span class="mono">{name}</span>
        {frame !== undefined && frame.formerParents.length > 0 && (
          <span class="badge warn" title="A frame has one parent: let one node publish it.">
            also below {frame.formerParents.join(", ")}
          </span>
        )}
      </th>
      {frame === undefined ? <td colSpan={7} /> : <Place frame={frame} />}
    </tr>
  );
}

function Place({ frame }: { readonly frame: Frame }) {
  const { isFixed, translation, rotation } = frame;
  const rate = rateOf(frame);
  return (
    <>
      <td class="number quiet">{isFixed ? "fixed" : rate === undefined ? "" : rateText(rate)}</td>
      {translation.map((each, at) => (
        <td key={at} class="number mono">
          {each.toFixed(3)}
        </td>
      ))}
      {rotation.map((each, at) => (
        <td key={at} class="number mono">
          {((each * 180) / Math.PI).toFixed(1)}
        </td>
      ))}
    </>
  );
}

/** The tree of what has come, or of the moment at which the page looks. */
function useTree(observation: Observation, isOpen: boolean): FrameTree {
  const { receiver, frames } = observation;
  const live = useRef(new FrameTree());
  useEffect(() => {
    if (!isOpen) return undefined;
    const tree = (live.current = new FrameTree()); // another run has others
    const take = (received: Received): void => takeInto(tree, received);
    for (const topic of [FIXED, MOVING]) for (const each of receiver.past(topic, MOST_BEFORE)) take(each);
    const ends = [FIXED, MOVING].map((topic) =>
      receiver.follow(topic, (received) => {
        take(received);
        frames.request();
      }),
    );
    return () => {
      for (const end of ends) end();
    };
  }, [receiver, frames, isOpen]);
  useFrames(observation);
  const momentNs = receiver.moment.value;
  const past = useMemo(() => (momentNs === undefined ? undefined : treeAt(receiver, momentNs, live.current.fixed)), [receiver, momentNs]);
  return past ?? live.current;
}

/** Returns the tree at a moment of the last 60 s; what is fixed may have come before. */
function treeAt(receiver: Receiver, momentNs: bigint, fixed: readonly Frame[]): FrameTree {
  const tree = new FrameTree(fixed);
  const before = receiver.past(MOVING, Infinity).filter(({ stampNs }) => stampNs <= momentNs);
  for (const each of before.slice(-MOST_BEFORE)) takeInto(tree, each);
  return tree;
}

function takeInto(tree: FrameTree, { reading, frame, stampNs }: Received): void {
  if (reading.fault === undefined) tree.take(reading.message, frame.channel.topic === FIXED, stampNs);
}

/** Frame tree: the frames that come on /tf and /tf_static, each with its parent and where it is seen from there. Pure. */
import { isArray, isRecord } from "../../messages/paths";
import { timeNs } from "../../messages/stamps";

type Triple = readonly [number, number, number];

/** Frame that has a parent. */
export interface Frame {
  readonly name: string;
  readonly parent: string;
  readonly isFixed: boolean;
  readonly translation: Triple;
  /** Roll, pitch and yaw about fixed axes, in radians. */
  readonly rotation: Triple;
  /** Stamps of its latest transforms in nanoseconds, oldest first; empty where they have none. */
  readonly stamps: readonly bigint[];
  /** The other parents that it has had. */
  readonly formerParents: readonly string[];
}

/** Line of the drawn tree. */
export interface FrameRow {
  readonly name: string;
  readonly depth: number;
  /** Undefined of a frame without a parent. */
  readonly frame: Frame | undefined;
}

const MOST_FRAMES = 2000;
const MOST_STAMPS = 50;
const MOST_PARENTS = 5;
/** How far publishing times go back where time itself does, as where a recording is played from an earlier moment. */
const SET_BACK_NS = 1_000_000_000n;

export class FrameTree {
  readonly #frames: Map<string, Frame>;
  #newestNs = 0n;

  /** Begins with some frames, which are fixed. */
  constructor(fixed: readonly Frame[] = []) {
    this.#frames = new Map(fixed.map((frame) => [frame.name, frame]));
  }

  get fixed(): readonly Frame[] {
    return [...this.#frames.values()].filter(({ isFixed }) => isFixed);
  }

  /** Takes the transforms of a message; what is none is left out. */
  take(message: unknown, isFixed: boolean, publishedNs: bigint): void {
    if (!isFixed) {
      if (publishedNs < this.#newestNs - SET_BACK_NS) this.#forgetMoving();
      this.#newestNs = publishedNs;
    }
    const transforms = isRecord(message) && isArray(message.transforms) ? message.transforms : [];
    for (const each of Array.from(transforms)) {
      const frame = frameOf(each, isFixed);
      if (frame === undefined) continue;
      const before = this.#frames.get(frame.name);
      if (before !== undefined) this.#frames.set(frame.name, joined(before, frame));
      else if (this.#frames.size < MOST_FRAMES) this.#frames.set(frame.name, frame);
    }
  }

  /** The frames as lines, each below its parent; frames that are in a circle begin at one of them. */
  rows(): readonly FrameRow[] {
    const children = this.#children();
    const rows: FrameRow[] = [];
    const left = new Set(this.#frames.keys());
    const add = (name: string, depth: number): void => {
      const frame = this.#frames.get(name);
      if (frame !== undefined && !left.delete(name)) return;
      rows.push({ name, depth, frame });
      for (const child of children.get(name) ?? []) add(child.name, depth + 1);
    };
    for (const parent of children.keys()) if (!this.#frames.has(parent)) add(parent, 0);
    for (const name of left) add(name, 0);
    return rows;
  }

  /** The frames of each parent, sorted by name. */
  #children(): ReadonlyMap<string, readonly Frame[]> {
    const children = new Map<string, Frame[]>();
    for (const frame of [...this.#frames.values()].sort((one, other) => (one.name < other.name ? -1 : 1))) {
      const siblings = children.get(frame.parent);
      if (siblings === undefined) children.set(frame.parent, [frame]);
      else siblings.push(frame);
    }
    return children;
  }

  #forgetMoving(): void {
    for (const { name, isFixed } of [...this.#frames.values()]) if (!isFixed) this.#frames.delete(name);
  }
}

/** Returns how many transforms of a frame come in a second, by their stamps; undefined where that is not known. */
export function rateOf({ stamps }: Frame): number | undefined {
  const [first, last] = [stamps[0], stamps.at(-1)];
  return first === undefined || last === undefined || last <= first ? undefined : ((stamps.length - 1) * 1e9) / Number(last - first);
}

function joined(before: Frame, now: Frame): Frame {
  const parents = before.parent === now.parent ? before.formerParents : [before.parent, ...before.formerParents];
  const formerParents = [...new Set(parents)].filter((each) => each !== now.parent).slice(0, MOST_PARENTS);
  return { ...now, stamps: [...before.stamps, ...now.stamps].slice(-MOST_STAMPS), formerParents };
}

function frameOf(transform: unknown, isFixed: boolean): Frame | undefined {
  if (!isRecord(transform) || !isRecord(transform.header) || !isRecord(transform.transform)) return undefined;
  const { child_frame_id: name, header } = transform;
  const [translation, quaternion] = [numbersOf(transform.transform.translation), numbersOf(transform.transform.rotation)];
  if (typeof name !== "string" || typeof header.frame_id !== "string" || name === "" || name === header.frame_id) return undefined;
  const stamp = timeNs(header.stamp);
  return {
    name,
    parent: header.frame_id,
    isFixed,
    translation: [translation.x, translation.y, translation.z],
    rotation: anglesOf(quaternion),
    stamps: stamp === undefined ? [] : [stamp],
    formerParents: [],
  };
}

type Numbers = Readonly<Record<"x" | "y" | "z" | "w", number>>;

function numbersOf(value: unknown): Numbers {
  const read = (key: string): number => (isRecord(value) && typeof value[key] === "number" ? value[key] : NaN);
  return { x: read("x"), y: read("y"), z: read("z"), w: read("w") };
}

function anglesOf({ x, y, z, w }: Numbers): Triple {
  const sine = Math.max(-1, Math.min(1, 2 * (w * y - z * x)));
  const roll = Math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y));
  return [roll, Math.asin(sine), Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))];
}

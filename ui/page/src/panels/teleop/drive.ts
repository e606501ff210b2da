/** Drive: a dead-man's switch. It publishes while it is held, and zero as soon as it is not. */

/** Parts of the greatest speeds, from -1 to 1: forward, and turning left. */
export interface Stick {
  readonly forward: number;
  readonly left: number;
}

export const REST: Stick = { forward: 0, left: 0 };
const PERIOD_MS = 50;
/** Zero is sent this often after a release: a receiver may be best-effort. */
const ZEROS = 3;

export class Drive {
  readonly #publish: (stick: Stick) => void;
  #stick: Stick = REST;
  #timer: ReturnType<typeof setTimeout> | undefined;
  #isHeld = false;
  #zerosLeft = 0;

  constructor(publish: (stick: Stick) => void) {
    this.#publish = publish;
  }

  get isHeld(): boolean {
    return this.#isHeld;
  }

  /** Holds the switch, or moves the stick while it is held. */
  hold(stick: Stick): void {
    this.#stick = clamped(stick);
    if (this.#isHeld) return;
    this.#isHeld = true;
    this.#tick();
  }

  /** Lets the switch go: zero is published at once. */
  release(): void {
    if (!this.#isHeld) return;
    this.#isHeld = false;
    this.#stick = REST;
    this.#zerosLeft = ZEROS;
    this.#tick();
  }

  /** Ends the drive: zeros that would still be due are published at once, for nothing can be published after this. */
  end(): void {
    this.release();
    while (this.#zerosLeft > 0) this.#tick();
    clearTimeout(this.#timer);
  }

  #tick(): void {
    clearTimeout(this.#timer);
    this.#publish(this.#stick);
    if (!this.#isHeld) this.#zerosLeft -= 1;
    if (this.#isHeld || this.#zerosLeft > 0) this.#timer = setTimeout(() => this.#tick(), PERIOD_MS);
  }
}

function clamped({ forward, left }: Stick): Stick {
  const within = (part: number): number => (Number.isFinite(part) ? Math.min(1, Math.max(-1, part)) : 0);
  return { forward: within(forward), left: within(left) };
}

/** The keys that drive, each with its part of the stick. */
const KEYS: Readonly<Record<string, Stick>> = {
  ArrowUp: { forward: 1, left: 0 },
  ArrowDown: { forward: -1, left: 0 },
  ArrowLeft: { forward: 0, left: 1 },
  ArrowRight: { forward: 0, left: -1 },
  KeyW: { forward: 1, left: 0 },
  KeyS: { forward: -1, left: 0 },
  KeyA: { forward: 0, left: 1 },
  KeyD: { forward: 0, left: -1 },
};

export function isDriveKey(code: string): boolean {
  return code in KEYS;
}

/** Returns the stick of the keys that are down; null where none drives. */
export function stickOf(codes: Iterable<string>): Stick | null {
  const sticks = [...codes].flatMap((code) => KEYS[code] ?? []);
  if (sticks.length === 0) return null;
  return clamped({
    forward: sticks.reduce((sum, { forward }) => sum + forward, 0),
    left: sticks.reduce((sum, { left }) => sum + left, 0),
  });
}

/** Returns a geometry_msgs/msg/Twist as CDR: forward along x, turning about z. */
export function twistBytes(linear: number, angular: number): Uint8Array {
  const view = new DataView(new ArrayBuffer(4 + 6 * 8));
  view.setUint8(1, 1); // little-endian
  view.setFloat64(4, linear, true);
  view.setFloat64(4 + 5 * 8, angular, true);
  return new Uint8Array(view.buffer);
}

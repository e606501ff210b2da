/** Lines: the numbers of fields over time, one ring for each field that some plot shows. */

import { signal } from "@preact/signals";
import { addressText, parseAddress, valueAt, type Address } from "../messages/paths";
import type { Received, Receiver } from "../messages/receiver";
import { Ring, type Points } from "../messages/ring";
import { numberOf } from "../messages/shapes";
import { stampNs } from "../messages/stamps";
import { unitAt } from "../messages/units";

const KEPT_S = 60;
const MOST_POINTS = 120_000;
const MOST_PAST = 20_000;

/** Clock of the plots: seconds since their origin. */
export interface Seconds {
  secondsOf(stampNs: bigint): number;
}

/** One field over time. */
export class Line {
  readonly ring = new Ring(MOST_POINTS, KEPT_S);
  #held: Points | undefined;
  #recorded: Points | undefined;
  #unit: string | undefined;
  #fault: string | undefined;

  constructor(readonly address: Address) {}

  /** Address as text, such as `imu/data.linear_acceleration.y`. */
  get text(): string {
    return addressText(this.address);
  }

  get unit(): string | undefined {
    return this.#unit;
  }

  /** Why nothing is drawn; undefined if the last message had a number. */
  get fault(): string | undefined {
    return this.#fault;
  }

  /** The points to draw: those of the whole recording, those of now, or where the lines are held, those of then. */
  get points(): Points {
    return this.#recorded ?? this.#held ?? this.ring.points;
  }

  /** Draws these points instead of what has come; undefined ends that. */
  showRecorded(points: Points | undefined): void {
    this.#recorded = points;
  }

  /** Adds the number of a message; returns whether time has jumped back. */
  take(received: Received, seconds: Seconds): boolean {
    const { reading } = received;
    if (reading.fault !== undefined) {
      this.#fault = reading.fault;
      return false;
    }
    const found = valueAt(this.address.path, reading.message);
    const value = numberOf(found);
    const fault = value === undefined ? `the last message has ${found === undefined ? "no value" : "no number"} there` : undefined;
    if (found === undefined && this.#isOfItem) {
      // A message without the named item says nothing of it, as those of other frames on /tf.
      this.#fault = this.ring.length === 0 ? fault : undefined;
      return false;
    }
    this.#fault = fault;
    if (this.#unit === undefined && received.shape !== undefined) this.#unit = unitAt(this.address.path, received.shape);
    if (value === undefined && this.ring.length === 0) return false;
    return this.ring.append(seconds.secondsOf(stampNs(reading.message, received.stampNs)), value ?? NaN);
  }

  /** Whether the field is that of an item with a name. */
  get #isOfItem(): boolean {
    return this.address.path.some((step) => typeof step === "object");
  }

  hold(): void {
    const { times, values, revision } = this.ring.points;
    this.#held = { times: times.slice(), values: values.slice(), revision };
  }

  release(): void {
    this.#held = undefined;
  }
}

interface Open {
  readonly line: Line;
  readonly end: () => void;
  uses: number;
}

export class Lines {
  readonly #receiver: Receiver;
  readonly #seconds: Seconds;
  readonly #changed: () => void;
  readonly #open = new Map<string, Open>();
  #isHeld = false;

  constructor(receiver: Receiver, seconds: Seconds, changed: () => void) {
    this.#receiver = receiver;
    this.#seconds = seconds;
    this.#changed = changed;
  }

  /** Opens the line of an address, with what the last 60 s have of it; throws a PathError. */
  open(text: string): Line {
    const address = parseAddress(text);
    const key = addressText(address);
    const known = this.#open.get(key) ?? this.#begin(key, address);
    known.uses += 1;
    return known.line;
  }

  /** Closes a line; it ends when each plot that has opened it has closed it. */
  close(line: Line): void {
    const known = this.#open.get(line.text);
    if (known?.line !== line) return;
    known.uses -= 1;
    if (known.uses > 0) return;
    this.#open.delete(line.text);
    known.end();
  }

  /** The open lines. */
  get opened(): readonly Line[] {
    return [...this.#open.values()].map(({ line }) => line);
  }

  /** Number that grows with each line that is opened. */
  readonly openings = signal(0);

  /** The newest moment of any line. */
  get newestS(): number | undefined {
    let newest: number | undefined;
    for (const { line } of this.#open.values()) {
      const { newest: each } = line.ring;
      if (each !== undefined && (newest === undefined || each > newest)) newest = each;
    }
    return newest;
  }

  /** Keeps what is drawn as it is; what comes goes on to be kept. */
  hold(): void {
    this.#isHeld = true;
    for (const { line } of this.#open.values()) line.hold();
  }

  release(): void {
    this.#isHeld = false;
    for (const { line } of this.#open.values()) line.release();
    this.#changed();
  }

  /** Breaks each line: what comes between is not known. */
  breakAll(): void {
    for (const { line } of this.#open.values()) line.ring.gap();
  }

  /** Drops what is after a moment from each line, and breaks it: time goes on from there. */
  continueFrom(timeS: number): void {
    for (const { line } of this.#open.values()) line.ring.cut(timeS);
    this.breakAll();
    this.#changed();
  }

  #begin(key: string, address: Address): Open {
    const line = new Line(address);
    const end = this.#receiver.follow(address.topic, (received) => {
      if (line.take(received, this.#seconds)) this.#jumped(line);
      this.#changed();
    });
    for (const received of this.#receiver.past(address.topic, MOST_PAST)) line.take(received, this.#seconds);
    if (this.#isHeld) line.hold();
    const open = { line, end, uses: 0 };
    this.#open.set(key, open);
    this.openings.value += 1;
    return open;
  }

  /** Takes the points that have not come yet from the other lines too, whose next message may be long in coming. */
  #jumped(line: Line): void {
    const { newest } = line.ring;
    if (newest === undefined) return;
    for (const { line: other } of this.#open.values()) if (other !== line) other.ring.cut(newest);
  }
}

/** Observation: what a page has received of its run, and the moment at which all its panels look. */

import { effect } from "@preact/signals";
import { limits } from "../limits";
import { Receiver } from "../messages/receiver";
import type { Session } from "../store/session";
import { Frames } from "./frames";
import { Lines } from "./lines";
import { Timeline } from "./timeline";
import { WholeRecording, type AskOverview } from "./whole_recording";

export class Observation {
  readonly timeline = new Timeline();
  readonly frames = new Frames();
  readonly receiver: Receiver;
  readonly lines: Lines;

  constructor(session: Pick<Session, "topics" | "isOpen"> & Partial<Pick<Session, "questions">>) {
    this.receiver = new Receiver(session.topics);
    this.lines = new Lines(this.receiver, this.timeline, () => this.frames.request());
    const { questions } = session;
    if (questions !== undefined) {
      const ask: AskOverview = (request) => questions.ask("overview", request, limits.overview);
      new WholeRecording(ask, this.timeline, this.lines, this.frames); // an effect keeps it
    }
    effect(() => {
      if (!session.isOpen.value) this.lines.breakAll();
    });
  }

  /** Keeps the last 60 s as they are, in all panels, while what comes goes on to be kept. */
  pause(): void {
    const { latestNs } = this.receiver;
    if (latestNs === undefined) return; // nothing has come that could be kept
    this.lines.hold();
    this.timeline.pausedS.value = this.lines.newestS ?? this.timeline.secondsOf(latestNs);
    this.receiver.lookAt(latestNs);
    this.frames.request();
  }

  /** Shows in all panels what was at a moment of the paused 60 s. */
  lookAt(stampNs: bigint): void {
    if (!this.timeline.isPaused.peek()) this.pause();
    this.receiver.lookAt(stampNs);
    this.frames.request();
  }

  resume(): void {
    this.timeline.pausedS.value = undefined;
    this.timeline.show(undefined);
    this.receiver.lookAt(undefined);
    this.lines.release();
  }

  toggle(): void {
    if (this.timeline.isPaused.peek()) this.resume();
    else this.pause();
  }
}

const OBSERVATIONS = new WeakMap<Session, Observation>();

/** Returns the observation that all panels of a session share. */
export function observationOf(session: Session): Observation {
  const known = OBSERVATIONS.get(session) ?? new Observation(session);
  OBSERVATIONS.set(session, known);
  return known;
}

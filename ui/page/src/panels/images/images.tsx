/** Images: the pictures of a camera, live. One is drawn at a time; those that come meanwhile are left out, and counted. */

import { useEffect, useRef, useState } from "preact/hooks";
import type { Channel } from "../../connection/protocol";
import { compressedOf, pixelsOf } from "../../messages/pixels";
import type { Received } from "../../messages/receiver";
import { stampText } from "../../messages/stamps";
import { useFollowed } from "../../plots/hooks";
import { observationOf } from "../../plots/observation";
import type { Session } from "../../store/session";
import { counted, rateText } from "../../store/text";
import type { PanelProps } from "../panel";
import "./images.css";

const RAW = "sensor_msgs/msg/Image";
const COMPRESSED = "sensor_msgs/msg/CompressedImage";

function isImage({ schemaName }: Channel): boolean {
  return schemaName === RAW || schemaName === COMPRESSED;
}

export function Images({ session, settings, onSettings }: PanelProps) {
  const topics = [...session.topics.channels.value.values()].filter(isImage).map(({ topic }) => topic);
  const chosen = typeof settings.topic === "string" ? settings.topic : topics.sort()[0];
  if (chosen === undefined) {
    return (
      <div class="empty">
        <strong>No images</strong>
        <span>Topics of {RAW} and {COMPRESSED} appear here.</span>
      </div>
    );
  }
  return (
    <div class="images">
      <div class="toolbar">
        <label class="small quiet">
          Topic{" "}
          <select value={chosen} onChange={(event) => onSettings({ ...settings, topic: event.currentTarget.value })}>
            {[...new Set([...topics, chosen])].sort().map((topic) => (
              <option key={topic}>{topic}</option>
            ))}
          </select>
        </label>
      </div>
      <Picture key={chosen} session={session} topic={chosen} />
    </div>
  );
}

interface Shown {
  readonly text: string;
  readonly isFault: boolean;
}

function Picture({ session, topic }: { readonly session: Session; readonly topic: string }) {
  const observation = observationOf(session);
  const canvas = useRef<HTMLCanvasElement>(null);
  const [shown, setShown] = useState<Shown>({ text: nothingText(session), isFault: false });
  useFollowed(observation, [topic]);
  useEffect(() => {
    let [last, isBusy, leftOut] = [undefined as bigint | undefined, false, 0];
    const draw = async (): Promise<void> => {
      const received = observation.receiver.shown(topic);
      if (received === undefined || received.stampNs === last || canvas.current === null) return;
      if (isBusy) {
        leftOut += 1;
        return;
      }
      [last, isBusy] = [received.stampNs, true];
      const about = await paint(canvas.current, received);
      isBusy = false;
      if (about instanceof Error) setShown({ text: about.message, isFault: true });
      else setShown({ text: textOf(received, about, observation.receiver.rateHz(topic), leftOut), isFault: false });
    };
    const end = observation.frames.listen(() => void draw());
    void draw();
    return end;
  }, [observation, topic]);
  return (
    <>
      <div class="picture">
        <canvas ref={canvas} role="img" aria-label={`Image of ${topic}`} hidden={shown.isFault} />
      </div>
      <p class={`picture-text small ${shown.isFault ? "bad" : "quiet"}`} role={shown.isFault ? "alert" : undefined}>
        {shown.text}
      </p>
    </>
  );
}

function nothingText({ source }: Session): string {
  return source.peek() === "recording" ? "No image up to this moment." : "No image has come yet.";
}

function textOf({ stampNs }: Received, about: string, rateHz: number | undefined, leftOut: number): string {
  const parts = [about, stampText(stampNs), ...(rateHz === undefined ? [] : [rateText(rateHz)])];
  if (leftOut > 0) parts.push(`${counted(leftOut, "image")} left out, as this page is too slow`);
  return parts.join(" · ");
}

/** Paints a message; returns what is known of the picture, or why there is none. */
async function paint(canvas: HTMLCanvasElement, { reading, frame }: Received): Promise<string | Error> {
  try {
    if (reading.fault !== undefined) throw new Error(reading.fault);
    const context = canvas.getContext("2d");
    if (context === null) throw new Error("this browser draws no pictures");
    if (frame.channel.schemaName === COMPRESSED) return await paintCompressed(context, reading.message);
    const { width, height, rgba, range } = pixelsOf(reading.message);
    resize(canvas, width, height);
    context.putImageData(new ImageData(rgba, width, height), 0, 0);
    return `${width} × ${height}${range === undefined ? "" : `, ${range}`}`;
  } catch (error) {
    return error instanceof Error ? error : new Error(String(error));
  }
}

async function paintCompressed(context: CanvasRenderingContext2D, message: unknown): Promise<string> {
  const { type, bytes } = compressedOf(message);
  const picture = await createImageBitmap(new Blob([bytes], { type })).catch(() => {
    throw new Error(`the ${type.slice(6).toUpperCase()} cannot be read`);
  });
  try {
    resize(context.canvas, picture.width, picture.height);
    context.drawImage(picture, 0, 0);
    return `${picture.width} × ${picture.height} ${type.slice(6).toUpperCase()}, ${Math.ceil(bytes.length / 1000)} kB`;
  } finally {
    picture.close();
  }
}

function resize(canvas: HTMLCanvasElement, width: number, height: number): void {
  if (canvas.width !== width) canvas.width = width;
  if (canvas.height !== height) canvas.height = height;
}

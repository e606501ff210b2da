/** Pixels: pictures of `sensor_msgs/Image` as RGBA, and those of `sensor_msgs/CompressedImage` by their first bytes. */

import { isRecord } from "./paths";

/** Picture as a canvas takes it. */
export interface Pixels {
  readonly width: number;
  readonly height: number;
  readonly rgba: Uint8ClampedArray<ArrayBuffer>;
  /** What the brightness means, where it is scaled. */
  readonly range?: string;
}

const MOST_PIXELS = 20_000_000;
const MOST_BYTES = 32_000_000;

interface Raw {
  readonly width: number;
  readonly height: number;
  readonly step: number;
  readonly data: Uint8Array;
  readonly isBigEndian: boolean;
}

type Paint = (raw: Raw, rgba: Uint8ClampedArray) => string | undefined;

const ENCODINGS: Readonly<Record<string, readonly [bytes: number, paint: Paint]>> = {
  rgb8: [3, coloured(3, [0, 1, 2])],
  bgr8: [3, coloured(3, [2, 1, 0])],
  rgba8: [4, coloured(4, [0, 1, 2])],
  bgra8: [4, coloured(4, [2, 1, 0])],
  mono8: [1, coloured(1, [0, 0, 0])],
  "8UC1": [1, coloured(1, [0, 0, 0])],
  "8UC3": [3, coloured(3, [2, 1, 0])],
  mono16: [2, scaled],
  "16UC1": [2, scaled],
};

/** Returns the pixels of a message of type Image; throws an Error whose message is a sentence. */
export function pixelsOf(message: unknown): Pixels {
  const { width, height, step, encoding, data, is_bigendian: bigEndian } = isRecord(message) ? message : {};
  if (!isSize(width) || !isSize(height) || typeof step !== "number" || !(data instanceof Uint8Array)) {
    throw new Error("the message is no image");
  }
  const [bytes, paint] = ENCODINGS[String(encoding)] ?? [];
  if (bytes === undefined || paint === undefined) {
    throw new Error(`the encoding ${JSON.stringify(encoding)} is not shown; known are ${Object.keys(ENCODINGS).join(", ")}`);
  }
  if (width * height > MOST_PIXELS) throw new Error(`an image of ${width} × ${height} is more than the page draws`);
  if (step < width * bytes || data.length < step * (height - 1) + width * bytes) {
    throw new Error(`the image is too short: ${width} × ${height} in ${String(encoding)}, and ${data.length} bytes in rows of ${step}`);
  }
  const rgba = new Uint8ClampedArray(width * height * 4);
  const range = paint({ width, height, step, data, isBigEndian: Boolean(bigEndian) }, rgba);
  return { width, height, rgba, ...(range === undefined ? {} : { range }) };
}

function isSize(value: unknown): value is number {
  return typeof value === "number" && Number.isInteger(value) && value > 0;
}

function coloured(bytes: number, [red, green, blue]: readonly [number, number, number]): Paint {
  return ({ width, height, step, data }, rgba) => {
    let to = 0;
    for (let row = 0; row < height; row += 1) {
      for (let from = row * step, end = from + width * bytes; from < end; from += bytes, to += 4) {
        rgba[to] = data[from + red] ?? 0;
        rgba[to + 1] = data[from + green] ?? 0;
        rgba[to + 2] = data[from + blue] ?? 0;
        rgba[to + 3] = 255;
      }
    }
    return undefined;
  };
}

/** Paints numbers of 16 bits from black, the least, to white, the greatest; 0, which means nothing measured, stays black. */
function scaled({ width, height, step, data, isBigEndian }: Raw, rgba: Uint8ClampedArray): string {
  const view = new DataView(data.buffer, data.byteOffset, data.byteLength);
  const valueAt = (row: number, column: number): number => view.getUint16(row * step + column * 2, !isBigEndian);
  let [least, greatest] = [65_536, 0];
  for (let row = 0; row < height; row += 1) {
    for (let column = 0; column < width; column += 1) {
      const value = valueAt(row, column);
      if (value !== 0 && value < least) least = value;
      if (value > greatest) greatest = value;
    }
  }
  const perLevel = 255 / Math.max(1, greatest - least);
  let to = 0;
  for (let row = 0; row < height; row += 1) {
    for (let column = 0; column < width; column += 1, to += 4) {
      const value = valueAt(row, column);
      rgba[to] = rgba[to + 1] = rgba[to + 2] = value === 0 ? 0 : (value - least) * perLevel;
      rgba[to + 3] = 255;
    }
  }
  return greatest === 0 ? "all 0" : `${least} black, ${greatest} white`;
}

/** Returns the bytes of a message of type CompressedImage, and their kind by how they begin; throws an Error. */
export function compressedOf(message: unknown): { readonly type: "image/jpeg" | "image/png"; readonly bytes: Uint8Array<ArrayBuffer> } {
  const data = isRecord(message) ? message.data : undefined;
  if (!(data instanceof Uint8Array)) throw new Error("the message is no image");
  if (data.length > MOST_BYTES) throw new Error(`an image of ${data.length} bytes is more than the page shows`);
  const begins = (...bytes: readonly number[]): boolean => bytes.every((each, at) => data[at] === each);
  const type = begins(0xff, 0xd8, 0xff) ? "image/jpeg" : begins(0x89, 0x50, 0x4e, 0x47) ? "image/png" : undefined;
  if (type === undefined) throw new Error("the image is neither JPEG nor PNG");
  const [width, height] = type === "image/png" ? pngSize(data) : jpegSize(data);
  // A few bytes can unfold to any number of pixels.
  if (width * height > MOST_PIXELS) throw new Error(`an image of ${width} × ${height} is more than the page draws`);
  return { type, bytes: new Uint8Array(data) };
}

function pngSize(data: Uint8Array): [number, number] {
  if (data.length < 24) return [0, 0];
  const view = new DataView(data.buffer, data.byteOffset);
  return [view.getUint32(16), view.getUint32(20)];
}

/** Returns the width and height in a JPEG's frame header; zeros where it has none. */
function jpegSize(data: Uint8Array): [number, number] {
  const view = new DataView(data.buffer, data.byteOffset, data.byteLength);
  for (let at = 2; at + 9 <= data.length && data[at] === 0xff; at += 2 + view.getUint16(at + 2)) {
    const marker = data[at + 1] ?? 0;
    const isFrame = marker >= 0xc0 && marker <= 0xcf && ![0xc4, 0xc8, 0xcc].includes(marker);
    if (isFrame) return [view.getUint16(at + 7), view.getUint16(at + 5)];
  }
  return [0, 0];
}

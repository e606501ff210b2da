/** Dense lines: those of a chart that have more points than columns, drawn together as one picture. */

import { Bitmap, type Ink, type Scaling } from "./bitmap";
import type { Columns } from "./columns";
import { dashOf, strokeOf, type Palette } from "./palette";

/** Opacity between the dashes of a line: its peaks are seen there too. */
const FAINT = 70;

/** Place of the picture, in pixels of the canvas. */
export interface Frame {
  readonly left: number;
  readonly top: number;
  readonly width: number;
  readonly height: number;
}

export class DenseLines {
  readonly #bitmap = new Bitmap();
  readonly #canvas = document.createElement("canvas");
  readonly #context = this.#canvas.getContext("2d");
  #image: ImageData | undefined;
  #inks: readonly Ink[] = [];
  #isEmpty = true;

  /** Takes the colours of so many lines. */
  restyle(palette: Palette, lines: number): void {
    const width = Math.max(1, Math.round(devicePixelRatio));
    this.#inks = Array.from({ length: lines }, (_, at) => {
      const [red, green, blue] = channelsOf(strokeOf(palette, at));
      const dash = dashOf(at).map((each) => Math.round(each * devicePixelRatio));
      return { full: wordOf(red, green, blue, 255), faint: wordOf(red, green, blue, FAINT), dash, width };
    });
  }

  /** Begins a picture of whole pixels, which the frame need not have where the screen is scaled. */
  begin(frame: Frame): void {
    const [width, height] = [Math.round(frame.width), Math.round(frame.height)];
    if (this.#bitmap.begin(width, height)) {
      [this.#canvas.width, this.#canvas.height] = [width, height];
      this.#image = new ImageData(this.#bitmap.bytes, width, height);
    }
    this.#isEmpty = true;
  }

  line(at: number, columns: Columns, scaling: Scaling): void {
    const ink = this.#inks[at];
    if (ink === undefined) return;
    this.#bitmap.line(columns, scaling, ink);
    this.#isEmpty = false;
  }

  /** Puts the picture where it belongs. */
  show(context: CanvasRenderingContext2D, { left, top }: Frame): void {
    if (this.#isEmpty || this.#image === undefined || this.#context === null) return;
    this.#context.putImageData(this.#image, 0, 0);
    context.drawImage(this.#canvas, Math.round(left), Math.round(top));
  }
}

/** Returns four bytes as the word in which they lie so in memory. */
function wordOf(...bytes: readonly [number, number, number, number]): number {
  return new Uint32Array(Uint8Array.from(bytes).buffer)[0] ?? 0;
}

/** Returns red, green and blue of a colour, as the browser reads it. */
function channelsOf(colour: string): readonly [number, number, number] {
  const context = new OffscreenCanvas(1, 1).getContext("2d", { willReadFrequently: true });
  if (context === null) return [0, 0, 0];
  context.fillStyle = colour;
  context.fillRect(0, 0, 1, 1);
  const [red = 0, green = 0, blue = 0] = context.getImageData(0, 0, 1, 1).data;
  return [red, green, blue];
}

/** Chart: the drawing of lines over the shared time, by uPlot; its marks, its two cursors, and its picture as PNG. */

import uPlot from "uplot";
import type { Points } from "../messages/ring";
import { Columns, pointsWithin, stretchOf, viewOf } from "./columns";
import type { Line } from "./lines";
import type { Observation } from "./observation";
import { DenseLines } from "./dense_lines";
import { dashOf, paletteOf, strokeOf, type Palette } from "./palette";
import { DISTANCES_S, numberText, tickText } from "./ticks";
import type { Stretch } from "./timeline";

const LINE_WIDTH = 1;
const DOT_RADIUS = 2.2;
const DOT_DISTANCE = 10; // pixels between points from which each is marked
const AXIS_HEIGHT = 30;
const AXIS_WIDTH = 58;
const LEAST_SIZE = 40;

interface Drawn {
  readonly line: Line;
  readonly scale: string;
  readonly columns: Columns;
  /** The points in the picture. */
  points: Points;
  /** Whether there are more of them than columns of pixels, which are drawn in their place. */
  isDense: boolean;
}

export class Chart {
  readonly #host: HTMLElement;
  readonly #observation: Observation;
  readonly #onHover: (timeS: number | undefined) => void;
  readonly #resize: ResizeObserver;
  #drawn: readonly Drawn[] = [];
  #units: readonly (string | undefined)[] = [];
  readonly #dense = new DenseLines();
  #palette: Palette;
  #plot: uPlot;
  #stretch: Stretch = { from: 0, to: 1 };

  constructor(host: HTMLElement, observation: Observation, onHover: (timeS: number | undefined) => void) {
    this.#host = host;
    this.#observation = observation;
    this.#onHover = onHover;
    this.#palette = paletteOf(host);
    this.#plot = this.#build();
    this.#resize = new ResizeObserver(() => {
      this.#plot.setSize(this.#size());
      this.draw();
    });
    this.#resize.observe(host);
  }

  /** The stretch of time that was drawn last. */
  get stretch(): Stretch {
    return this.#stretch;
  }

  /** Returns the moment at a place of the page; undefined beside the drawing. */
  momentAt(clientX: number): number | undefined {
    const { left, width } = this.#plot.over.getBoundingClientRect();
    return clientX < left || clientX > left + width ? undefined : this.#plot.posToVal(clientX - left, "x");
  }

  /** Number of pixels between the left and the right end of the drawing. */
  get columns(): number {
    return Math.max(1, Math.round(this.#plot.bbox.width));
  }

  setLines(lines: readonly Line[]): void {
    this.#units = lines.map((line) => line.unit);
    const [first] = this.#units;
    const second = this.#units.find((unit) => unit !== first);
    this.#drawn = lines.map((line) => ({
      line,
      scale: line.unit !== first && line.unit === second ? "right" : "left",
      columns: new Columns(),
      points: line.points,
      isDense: false,
    }));
    this.#rebuild();
  }

  /** Takes the colours of the theme again. */
  restyle(): void {
    this.#palette = paletteOf(this.#host);
    this.#rebuild();
  }

  draw(): void {
    // The unit of a line is known with its first message.
    if (this.#drawn.some(({ line }, at) => line.unit !== this.#units[at])) this.setLines(this.#drawn.map(({ line }) => line));
    const { timeline, lines } = this.#observation;
    const view = viewOf(timeline.stretch(lines.newestS ?? 0), this.columns);
    this.#stretch = stretchOf(view);
    for (const drawn of this.#drawn) {
      drawn.points = pointsWithin(drawn.line.points, this.#stretch);
      drawn.isDense = drawn.points.times.length > view.columns;
      if (drawn.isDense) drawn.columns.update(drawn.line.points, view);
    }
    this.#plot.batch(() => {
      this.#plot.setScale("x", { min: this.#stretch.from, max: this.#stretch.to });
      for (const scale of ["left", "right"]) {
        const [min, max] = this.#range(scale);
        this.#plot.setScale(scale, { min, max });
      }
    });
  }

  /** Returns the picture as PNG, with the names of its lines. */
  async png(title: (line: Line) => string): Promise<Blob> {
    this.draw();
    await new Promise(requestAnimationFrame);
    const { canvas } = this.#plot.ctx;
    const ratio = devicePixelRatio;
    const rowHeight = 18 * ratio;
    const picture = document.createElement("canvas");
    picture.width = canvas.width;
    picture.height = canvas.height + rowHeight * this.#drawn.length + 8 * ratio;
    const context = picture.getContext("2d");
    if (context === null) throw new Error("this browser draws no pictures");
    context.fillStyle = this.#palette.paper;
    context.fillRect(0, 0, picture.width, picture.height);
    context.drawImage(canvas, 0, 0);
    context.font = `${12 * ratio}px system-ui, sans-serif`;
    this.#drawn.forEach(({ line }, at) => {
      const middle = canvas.height + rowHeight * (at + 0.5);
      context.strokeStyle = strokeOf(this.#palette, at);
      context.lineWidth = 2 * ratio;
      context.setLineDash(dashOf(at).map((each) => each * ratio));
      context.stroke(new Path2D(`M${12 * ratio} ${middle}h${24 * ratio}`));
      context.fillStyle = this.#palette.ink;
      context.fillText(title(line), 44 * ratio, middle + 4 * ratio);
    });
    return new Promise((resolve, reject) =>
      picture.toBlob((blob) => (blob === null ? reject(new Error("the picture is too large")) : resolve(blob)), "image/png"),
    );
  }

  destroy(): void {
    this.#resize.disconnect();
    this.#plot.destroy();
  }

  #rebuild(): void {
    this.#plot.destroy();
    this.#plot = this.#build();
    this.#observation.frames.request();
  }

  #size(): { width: number; height: number } {
    const { clientWidth, clientHeight } = this.#host;
    return { width: Math.max(LEAST_SIZE, clientWidth), height: Math.max(LEAST_SIZE, clientHeight) };
  }

  #build(): uPlot {
    this.#dense.restyle(this.#palette, this.#drawn.length);
    const hasRight = this.#drawn.some(({ scale }) => scale === "right");
    const unitOf = (scale: string): string | undefined => this.#drawn.find((each) => each.scale === scale)?.line.unit;
    const right = hasRight ? [this.#valueAxis("right", 1, unitOf("right"))] : [];
    const options: uPlot.Options = {
      ...this.#size(),
      legend: { show: false },
      padding: [10, hasRight ? 0 : 12, 0, 0],
      scales: { x: { time: false, auto: false }, left: { auto: false, range: [0, 1] }, right: { auto: false, range: [0, 1] } },
      // Without a line no number has a meaning.
      axes: this.#drawn.length === 0 ? [{ show: false }, { show: false }] : [this.#timeAxis(), this.#valueAxis("left", 3, unitOf("left")), ...right],
      series: [{}, ...this.#drawn.map((each, at) => this.#series(each, at))],
      cursor: {
        y: false,
        points: { show: false },
        drag: { x: true, y: false, setScale: false },
        // The other plots show the same moment; what is done with the pointer in this one is done once.
        sync: { key: "busflow", scales: ["x", null], filters: { pub: (type) => type === "mousemove" || type === "mouseleave" } },
      },
      hooks: {
        setSelect: [(plot) => this.#select(plot)],
        setCursor: [(plot) => this.#onHover(plot.cursor.left === undefined || plot.cursor.left < 0 ? undefined : plot.posToVal(plot.cursor.left, "x"))],
        drawAxes: [(plot) => this.#drawDense(plot)],
        draw: [(plot) => this.#drawCursors(plot)],
      },
    };
    // The points are drawn from the rings; uPlot itself is given the ends of the stretch.
    return new uPlot(options, [[0, 1], ...this.#drawn.map(() => [0, 0])], this.#host);
  }

  #timeAxis(): uPlot.Axis {
    return {
      ...this.#axis(),
      size: AXIS_HEIGHT,
      space: 90,
      incrs: [...DISTANCES_S],
      values: (...[, splits, , , distanceS]: [uPlot, number[], number, number, number]) =>
        splits.map((each) => tickText(this.#observation.timeline.stampOf(each), distanceS)),
    };
  }

  #valueAxis(scale: string, side: 1 | 3, unit: string | undefined): uPlot.Axis {
    return {
      ...this.#axis(),
      scale,
      // eslint-disable-next-line @typescript-eslint/no-unsafe-enum-assignment -- a const enum of a library has no value
      side,
      size: AXIS_WIDTH,
      grid: { show: scale === "left", stroke: this.#palette.grid, width: 1 },
      values: (_, splits) => splits.map(numberText),
      ...(unit === undefined ? {} : { label: unit, labelSize: 16, labelGap: 0, labelFont: "12px system-ui, sans-serif" }),
    };
  }

  #axis(): uPlot.Axis {
    const { quiet, grid } = this.#palette;
    return {
      stroke: quiet,
      font: "11px system-ui, sans-serif",
      grid: { stroke: grid, width: 1 },
      ticks: { stroke: grid, width: 1, size: 4 },
    };
  }

  #series(drawn: Drawn, at: number): uPlot.Series {
    const stroke = strokeOf(this.#palette, at);
    return {
      scale: drawn.scale,
      stroke,
      fill: stroke,
      width: LINE_WIDTH,
      dash: [...dashOf(at)],
      cap: "round",
      points: { show: false },
      paths: (plot) => pathOf(plot, drawn),
    };
  }

  #range(scale: string): [number, number] {
    let [least, greatest] = [Infinity, -Infinity];
    for (const { columns, points, isDense, scale: own } of this.#drawn) {
      if (own !== scale) continue;
      for (const value of isDense ? columns.least : points.values) if (value < least) least = value;
      for (const value of isDense ? columns.greatest : points.values) if (value > greatest) greatest = value;
    }
    if (least > greatest) return [0, 1];
    if (least === 0 && greatest === 0) return [-1, 1]; // uPlot takes 0 to 100
    const [min, max] = uPlot.rangeNum(least, greatest, 0.08, true);
    return [min ?? least, max ?? greatest];
  }

  #select(plot: uPlot): void {
    const { left, width } = plot.select;
    if (width < 4) return;
    const [from, to] = [plot.posToVal(left, "x"), plot.posToVal(left + width, "x")];
    plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
    if (!this.#observation.timeline.isPaused.peek()) this.#observation.pause();
    this.#observation.timeline.show({ from, to });
    this.#observation.frames.request();
  }

  #drawDense({ ctx, bbox, scales }: uPlot): void {
    // A panel may be too small to have any pixels.
    if (bbox.width < 1 || bbox.height < 1 || !this.#drawn.some(({ isDense }) => isDense)) return;
    this.#dense.begin(bbox);
    for (const [at, { columns, isDense, scale }] of this.#drawn.entries()) {
      const y = scales[scale];
      if (!isDense || y?.min == null || y.max == null) continue;
      this.#dense.line(at, columns, { greatest: y.max, perUnit: bbox.height / (y.max - y.min) });
    }
    this.#dense.show(ctx, bbox);
  }

  #drawCursors(plot: uPlot): void {
    const { ctx, bbox } = plot;
    const { timeline, receiver } = this.#observation;
    const momentNs = receiver.moment.peek();
    const marks: (readonly [string, number | undefined])[] = timeline.cursors.peek().map((each, at) => [at === 0 ? "A" : "B", each]);
    if (momentNs === undefined && timeline.whole.peek() !== undefined && receiver.latestNs !== undefined) {
      marks.push(["", timeline.secondsOf(receiver.latestNs)]); // where the recording stands
    }
    if (momentNs !== undefined) marks.push(["", timeline.secondsOf(momentNs)]);
    ctx.save();
    ctx.font = `${11 * devicePixelRatio}px system-ui, sans-serif`;
    ctx.textAlign = "left";
    ctx.textBaseline = "alphabetic";
    for (const [name, time] of marks) {
      if (time === undefined || time < this.#stretch.from || time > this.#stretch.to) continue;
      const x = Math.round(plot.valToPos(time, "x", true));
      ctx.strokeStyle = ctx.fillStyle = name === "" ? this.#palette.accent : this.#palette.ink;
      ctx.lineWidth = devicePixelRatio;
      ctx.setLineDash(name === "" ? [] : [4 * devicePixelRatio, 3 * devicePixelRatio]);
      ctx.stroke(new Path2D(`M${x} ${bbox.top}v${bbox.height}`));
      ctx.fillText(name, x + 3 * devicePixelRatio, bbox.top + 11 * devicePixelRatio);
    }
    ctx.restore();
  }
}

/** Returns the path of a line's points, broken at its gaps; where they stand far apart, a dot for each. */
function pathOf({ bbox, scales }: uPlot, { points, isDense, scale }: Drawn): uPlot.Series.Paths | null {
  const [x, y] = [scales.x, scales[scale]];
  if (isDense) return null; // drawn already
  if (x?.min == null || x.max == null || y?.min == null || y.max == null) return null;
  const [perSecond, perUnit] = [bbox.width / (x.max - x.min), bbox.height / (y.max - y.min)];
  const { times, values } = points;
  const count = times.length;
  const stroke = new Path2D();
  const lengthS = (times[count - 1] ?? 0) - (times[0] ?? 0);
  const dots = count * DOT_DISTANCE * devicePixelRatio < Math.min(bbox.width, lengthS * perSecond) ? new Path2D() : null;
  const radius = DOT_RADIUS * devicePixelRatio;
  let isBroken = true;
  for (let at = 0; at < count; at += 1) {
    const value = values[at] ?? NaN;
    if (Number.isNaN(value)) {
      isBroken = true;
      continue;
    }
    const left = bbox.left + ((times[at] ?? 0) - x.min) * perSecond;
    const height = bbox.top + (y.max - value) * perUnit;
    if (isBroken) stroke.moveTo(left, height);
    stroke.lineTo(left, height);
    isBroken = false;
    dots?.moveTo(left + radius, height);
    dots?.arc(left, height, radius, 0, 2 * Math.PI);
  }
  return { stroke, fill: dots, flags: 0 };
}

/** One chart on a canvas: axes, shaded phases, bands, lines, marks, and what is read under the pointer. */

import { colours, type Ink } from "./ink";

interface Tick {
  place: number;
  label: string;
}
export interface Axis {
  low: number;
  high: number;
  ticks: readonly Tick[];
  name?: string;
}
type Point = readonly [number, number];
export interface Line {
  name?: string;
  points: readonly Point[];
  colour: string;
  width?: number;
  dash?: number[];
}
/** Between a lower and an upper line. */
export interface Area {
  name?: string;
  points: readonly (readonly [number, number, number])[];
  colour: string;
}
export interface Mark {
  name?: string;
  at: Point;
  shape: "diamond" | "ring" | "bar";
  colour: string;
}
export interface Drawing {
  title: string;
  x: Axis;
  y: Axis;
  phases?: readonly { from: number; to: number; name: string; shaded: boolean }[];
  areas?: readonly Area[];
  lines: readonly Line[];
  marks?: readonly Mark[];
  /** What is said of the place under the pointer. */
  tell?: (x: number) => string;
}

const EDGE = { left: 54, right: 16, top: 30, bottom: 24 };
const LEGEND_HEIGHT = 20;
const NAME_HEIGHT = 16;

export class Chart {
  readonly canvas = document.createElement("canvas");
  private readonly said = document.createElement("output");
  private last?: Drawing;

  /** @param placed Is called after each drawing. */
  constructor(
    readonly host: HTMLElement,
    private readonly placed?: () => void,
  ) {
    this.said.className = "said";
    this.said.setAttribute("aria-hidden", "true");
    this.canvas.setAttribute("role", "img");
    host.append(this.canvas, this.said);
    host.addEventListener("pointermove", ({ clientX }) => this.tell(clientX));
    host.addEventListener("pointerleave", () => (this.said.textContent = ""));
    new ResizeObserver(() => this.last && this.draw(this.last)).observe(host);
  }

  label(text: string): void {
    this.canvas.setAttribute("aria-label", text);
  }

  /** Pixels of a point in the host. */
  pixel([x, y]: Point): [number, number] {
    const { left, top, width, height } = this.frame();
    const { x: across, y: up } = this.last!;
    return [
      left + ((x - across.low) / (across.high - across.low)) * width,
      top + ((up.high - y) / (up.high - up.low)) * height,
    ];
  }

  /** The point at a place of the window. */
  point(clientX: number, clientY: number): [number, number] {
    const box = this.canvas.getBoundingClientRect();
    const { left, top, width, height } = this.frame();
    const { x, y } = this.last!;
    return [
      x.low + ((clientX - box.left - left) / width) * (x.high - x.low),
      y.high - ((clientY - box.top - top) / height) * (y.high - y.low),
    ];
  }

  draw(drawing: Drawing): void {
    this.last = drawing;
    const [width, height] = [this.host.clientWidth, this.host.clientHeight];
    if (width < 100 || height < 80) return;
    const scale = devicePixelRatio;
    [this.canvas.width, this.canvas.height] = [width * scale, height * scale];
    const [pen, ink] = [this.canvas.getContext("2d")!, colours()];
    pen.scale(scale, scale);
    pen.fillStyle = ink.paper;
    pen.fillRect(0, 0, width, height);
    this.axes(pen, ink);
    const frame = this.frame();
    pen.save();
    pen.beginPath();
    pen.rect(frame.left, frame.top, frame.width, frame.height);
    pen.clip();
    for (const area of drawing.areas ?? []) {
      const upper = area.points.map(([x, , high]) => [x, high] as const);
      const lower = area.points.map(([x, low]) => [x, low] as const).reverse();
      this.trace(pen, [...upper, ...lower]);
      pen.fillStyle = area.colour;
      pen.fill();
    }
    for (const line of drawing.lines) {
      this.trace(pen, line.points);
      pen.strokeStyle = line.colour;
      pen.lineWidth = line.width ?? 2;
      pen.lineJoin = "round";
      pen.setLineDash(line.dash ?? []);
      pen.stroke();
    }
    pen.restore();
    for (const { at, shape, colour } of drawing.marks ?? []) mark(pen, shape, this.pixel(at), colour);
    this.legend(pen, ink);
    this.placed?.();
  }

  private frame() {
    const { x, lines, areas, marks } = this.last!;
    const named = [...lines, ...(areas ?? []), ...(marks ?? [])].some(({ name }) => name);
    const top = EDGE.top + (named ? LEGEND_HEIGHT : 0);
    const bottom = EDGE.bottom + (x.name ? NAME_HEIGHT : 0);
    const { clientWidth, clientHeight } = this.host;
    const [width, height] = [clientWidth - EDGE.left - EDGE.right, clientHeight - top - bottom];
    return { left: EDGE.left, top, width, height };
  }

  private trace(pen: CanvasRenderingContext2D, points: readonly Point[]): void {
    pen.beginPath();
    for (const point of points) pen.lineTo(...this.pixel(point));
  }

  private axes(pen: CanvasRenderingContext2D, ink: Ink): void {
    const { title, x, y, phases } = this.last!;
    const { left, top, width, height } = this.frame();
    for (const { from, to, name, shaded } of phases ?? []) {
      const [start, end] = [this.pixel([from, 0])[0], Math.min(this.pixel([to, 0])[0], left + width)];
      pen.fillStyle = ink.band;
      if (shaded) pen.fillRect(start, top, end - start, height);
      pen.fillStyle = ink.muted;
      pen.font = `11px ${ink.font}`;
      pen.textAlign = "center";
      if (end - start > 50) pen.fillText(name, 0.5 * (start + end), top + height - 6);
    }
    pen.lineWidth = 1;
    pen.fillStyle = ink.muted;
    pen.font = `11.5px ${ink.font}`;
    pen.strokeStyle = ink.line;
    pen.textAlign = "right";
    let below = Infinity;
    for (const { place, label } of y.ticks) {
      const level = this.pixel([0, place])[1];
      pen.strokeRect(left, level, width, 0);
      if (below - level < 12) continue;
      pen.fillText(label, left - 6, level + 4);
      below = level;
    }
    let free = -Infinity;
    for (const { place, label } of x.ticks) {
      const across = this.pixel([place, 0])[0];
      const half = 0.5 * pen.measureText(label).width;
      const centre = Math.min(Math.max(across, left + half - 8), left + width - half + 12);
      pen.strokeRect(across, top + height, 0, 4);
      if (centre - half < free) continue;
      pen.textAlign = "center";
      pen.fillText(label, centre, top + height + 17);
      free = centre + half + 8;
    }
    pen.strokeRect(left, top, 0, height);
    if (x.name) pen.fillText(x.name, left + 0.5 * width, top + height + 33);
    pen.fillStyle = ink.text;
    pen.textAlign = "left";
    pen.font = `600 13px ${ink.font}`;
    pen.fillText(title, 12, 20);
  }

  private legend(pen: CanvasRenderingContext2D, ink: Ink): void {
    const { lines, areas, marks } = this.last!;
    const narrow = this.host.clientWidth < 420;
    pen.font = `${narrow ? 11 : 12}px ${ink.font}`;
    pen.textAlign = "left";
    let at = 14;
    const [middle, size] = [EDGE.top + 6, narrow ? 13 : 18];
    const entry = (name: string, sample: () => void) => {
      sample();
      pen.fillStyle = ink.text;
      pen.fillText(name, at + size + 5, middle + 4);
      at += size + (narrow ? 11 : 16) + pen.measureText(name).width;
    };
    for (const { name, colour, width, dash } of lines) {
      if (!name) continue;
      entry(name, () => {
        pen.strokeStyle = colour;
        pen.lineWidth = width ?? 2;
        pen.setLineDash(dash ?? []);
        pen.beginPath();
        pen.moveTo(at, middle);
        pen.lineTo(at + size, middle);
        pen.stroke();
        pen.setLineDash([]);
      });
    }
    for (const { name, colour } of areas ?? []) {
      if (!name) continue;
      entry(name, () => {
        pen.fillStyle = colour;
        pen.fillRect(at, middle - 5, size, 10);
      });
    }
    for (const { name, shape, colour } of marks ?? []) {
      if (name) entry(name, () => mark(pen, shape, [at + 0.5 * size, middle], colour));
    }
  }

  private tell(clientX: number): void {
    if (!this.last?.tell) return;
    const [x] = this.point(clientX, 0);
    const within = x >= this.last.x.low && x <= this.last.x.high;
    this.said.textContent = within ? this.last.tell(x) : "";
  }
}

function mark(pen: CanvasRenderingContext2D, shape: Mark["shape"], [x, y]: Point, colour: string): void {
  pen.beginPath();
  if (shape === "diamond") for (const [dx, dy] of [[0, -6.5], [6.5, 0], [0, 6.5], [-6.5, 0]]) pen.lineTo(x + dx!, y + dy!);
  else if (shape === "ring") pen.arc(x, y, 9, 0, 2 * Math.PI);
  else pen.rect(x - 6.5, y - 1, 13, 2);
  pen.closePath();
  pen.fillStyle = pen.strokeStyle = colour;
  pen.lineWidth = 2;
  if (shape === "ring") pen.stroke();
  else pen.fill();
}

/** About five round ticks between two values, and the axis that they end. */
export function evenAxis(values: readonly number[], size = 1): Axis {
  let [low, high] = [Math.min(...values), Math.max(...values)];
  if (!(high > low)) [low, high] = [low - 1, high + 1];
  const rough = ((high - low) * size) / 5;
  const decade = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((part) => part * decade).find((part) => part >= rough)!;
  const digits = Math.max(0, Math.min(20, -Math.floor(Math.log10(step) + 1e-9)));
  const [first, last] = [Math.floor((low * size) / step + 1e-9), Math.ceil((high * size) / step - 1e-9)];
  const ticks = Array.from({ length: last - first + 1 }, (_, i) => {
    const value = (first + i) * step;
    const label = Math.abs(value) >= 1e5 ? value.toExponential(1).replace("e+", "e").replace(".0e", "e") : value.toFixed(digits);
    return { place: value / size, label: label.replace(/^-0$/, "0").replace("-", "−") };
  });
  return { low: (first * step) / size, high: (last * step) / size, ticks };
}

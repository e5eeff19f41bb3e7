/** The charts: force history, protocol with its corners, and the loop of force over indentation. */

import { forceAxis, TimeScale, type View } from "./axes";
import { Chart, evenAxis, type Area, type Axis, type Drawing, type Line, type Mark } from "./chart";
import { Corners } from "./corners";
import { significant } from "./format";
import { colours, type Ink } from "./ink";
import type { Band, Prediction } from "./model";
import { corners, linearly, type Grid, type Protocol } from "./protocol";
import { handyScales, type Units } from "./units";

/** What is drawn; dimensionless. */
interface Picture {
  protocol: Protocol;
  /** The surrogate's, where there is a model and it may be asked. */
  prediction?: Prediction;
  /** The solver's, of this very protocol. */
  computed?: { grid: Grid; force: readonly number[] };
  pinned?: { protocol: Protocol; prediction: Prediction };
  units: Units;
  view: View;
}
interface History {
  grid: Grid;
  force: ArrayLike<number>;
}
const ROOM = 1.06;
type Where = (grid: Grid, step: number) => number;

export class Plots {
  private readonly history: Chart;
  private readonly loop: Chart;
  private readonly protocol: Chart;
  readonly corners: Corners;
  private last?: Picture;
  /** The instant of the film, where it is that of this protocol. */
  private instant?: number;
  private axes?: { end: number; depth: Axis };

  constructor(
    hosts: Record<"history" | "loop" | "protocol", HTMLElement>,
    current: () => Protocol,
    changed: (protocol: Protocol) => void,
  ) {
    this.history = new Chart(hosts.history);
    this.loop = new Chart(hosts.loop);
    this.protocol = new Chart(hosts.protocol, () => this.corners?.place());
    this.corners = new Corners(this.protocol, current, changed, () => this.redraw());
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.redraw());
  }

  draw(picture: Picture): void {
    this.last = picture;
    this.redraw();
  }

  /** Mark an instant on the solver's force, or none. */
  mark(time: number | undefined): void {
    this.instant = time;
    this.redraw();
  }

  private redraw(): void {
    if (!this.last) return;
    const { protocol, prediction, computed, pinned, units, view } = this.last;
    const ink = colours();
    const scale = new TimeScale(protocol, view.time);
    const shown = [prediction, computed, pinned?.prediction].filter((one) => one !== undefined) as History[];
    const forces = shown.flatMap(({ force }) => [...Array.from(force)]);
    const band = prediction?.band;
    const reach = [...forces, ...(band ? [...band.lower, ...band.upper] : [])];
    const { times, indentations } = corners(protocol);
    const sizes = handyScales(units, indentations[1]!, times[3]!, Math.max(...forces.map(Math.abs), 1e-9));
    const { axis, height } = forceAxis(reach.length ? reach : [-1, 1], view.force, sizes.force.size);
    if (!reach.length) axis.ticks = [];
    const other = pinned && new TimeScale(pinned.protocol, view.time);
    const levels = [...indentations, ...(pinned ? corners(pinned.protocol).indentations : [])];
    // While a corner is dragged, the axes stay, so that it stays under the pointer; else there is room behind the last.
    if (!this.corners.held || !this.axes) {
      this.axes = { end: ROOM * Math.max(scale.places[3]!, other?.places[3] ?? 0), depth: evenAxis(levels, sizes.length.size) };
    }
    const { end, depth } = this.axes;
    // Each protocol by its own phases, whose widths follow one rule.
    const when: Where = (grid, step) => (grid === pinned?.prediction.grid ? other! : scale).place(grid.times[step]!);
    const deep: Where = (grid, step) => grid.indentations[step]!;
    const time = scale.axis(end, sizes.time.size, `time / ${sizes.time.name}`);
    const force = `P / ${bracketed(sizes.force.name)}`;
    this.history.draw({
      title: `Force ${force}, tension positive`,
      x: time,
      y: axis,
      phases: scale.phases(),
      ...this.curves(this.last, when, height, ink),
      tell: (x) => this.told(scale.instant(x), sizes),
    });
    this.loop.draw({
      title: `Loop: force ${force}`,
      x: { ...depth, name: `indentation δ / ${sizes.length.name}` },
      y: axis,
      ...this.curves(this.last, deep, height, ink, false),
    });
    this.corners.take(protocol, scale);
    this.path(this.last, [scale, other], { ...time, name: undefined }, depth, ink, sizes.length.name);
    this.label(this.last);
  }

  private path({ protocol, pinned }: Picture, [scale, other]: readonly [TimeScale, TimeScale?], x: Drawing["x"], y: Drawing["y"], ink: Ink, unit: string): void {
    const lines: Line[] = [];
    const add = (of: Protocol, { places }: TimeScale, colour: string, dash: number[] = []) => {
      lines.push({ points: corners(of).indentations.map((depth, i) => [places[i]!, depth]), colour, dash });
    };
    if (pinned) add(pinned.protocol, other!, ink.pinned, [6, 4]);
    add(protocol, scale, ink.path);
    const title = `Protocol: indentation δ / ${unit}. Drag its corners`;
    // Room for the handles above the peak.
    const roomy = { ...y, high: y.high + 0.1 * (y.high - y.low) };
    this.protocol.draw({ title, x, y: roomy, phases: scale.phases(), lines });
  }

  /** Lines, band and marks of force; named once. */
  private curves({ prediction, computed, pinned }: Picture, where: Where, height: (force: number) => number, ink: Ink, named = true) {
    const of = ({ grid, force }: History) =>
      Array.from(force as ArrayLike<number>, (value, step) => [where(grid, step), height(value)] as const);
    const name = (text: string) => (named ? text : undefined);
    const lines: Line[] = [];
    if (pinned) lines.push({ name: name("pinned"), points: of(pinned.prediction), colour: ink.pinned, dash: [6, 4] });
    if (computed) lines.push({ name: name("computed"), points: of(computed), colour: ink.solver, width: 2.6 });
    if (prediction) lines.push({ name: name("predicted"), points: of(prediction), colour: ink.surrogate, width: 1.8 });
    const areas: Area[] = [];
    const marks: Mark[] = [];
    if (prediction) {
      const { grid, pullOff, band } = prediction;
      if (band) areas.push(...bandAreas(band, grid, (step) => where(grid, step), height, ink, name("90 % band")));
      const at = linearly(pullOff.time, grid.times, grid.times.map((_, step) => where(grid, step)));
      for (const value of band?.pullOff ?? []) marks.push({ at: [at, height(value)], shape: "bar", colour: ink.peak });
      marks.push({ name: name("pull-off"), at: [at, height(pullOff.force)], shape: "diamond", colour: ink.peak });
    }
    if (computed && this.instant !== undefined) {
      const { grid, force } = computed;
      const at = linearly(this.instant, grid.times, grid.times.map((_, step) => where(grid, step)));
      marks.push({ at: [at, height(linearly(this.instant, grid.times, force))], shape: "ring", colour: ink.solver });
    }
    return { lines, areas, marks };
  }

  private told(time: number, { time: unit, force: strength }: ReturnType<typeof handyScales>): string {
    const { prediction, computed } = this.last!;
    const said = [`t ${significant(time * unit.size, 3)}`];
    for (const [name, of] of [["predicted", prediction], ["computed", computed]] as const) {
      if (of) said.push(`${name} ${significant(linearly(time, of.grid.times, of.force) * strength.size, 4)}`);
    }
    return said.join(" · ");
  }

  /** The film above its caption and all charts in one picture, as a PNG in a data URL. */
  png(film: HTMLCanvasElement, caption: string): string {
    const all = [film, this.history.canvas, this.loop.canvas, this.protocol.canvas].filter(({ width }) => width > 0);
    const [wide, high] = [Math.max(...all.map(({ width }) => width)), Math.max(...all.map(({ height }) => height))];
    const sheet = document.createElement("canvas");
    [sheet.width, sheet.height] = [2 * wide, 2 * high];
    const pen = sheet.getContext("2d")!;
    pen.fillStyle = colours().paper;
    pen.fillRect(0, 0, sheet.width, sheet.height);
    all.forEach((canvas, i) => pen.drawImage(canvas, (i % 2) * wide, Math.floor(i / 2) * high));
    const ink = colours();
    pen.font = `${12 * devicePixelRatio}px ${ink.font}`;
    pen.fillStyle = ink.text;
    pen.fillText(caption, 12, film.height + 20 * devicePixelRatio, wide - 24);
    return sheet.toDataURL("image/png");
  }

  private label({ protocol, prediction }: Picture): void {
    const { times, indentations } = corners(protocol);
    const [peak, duration] = [indentations[1]!, times[3]!].map((value) => significant(value, 4));
    const top = prediction
      ? `pull-off force ${significant(prediction.pullOff.force, 4)} at time ${significant(prediction.pullOff.time, 4)}`
      : "no prediction";
    this.protocol.label(`Indentation against time: up to ${peak}, held, and back, in a time of ${duration}.`);
    this.history.label(`Force against time: ${top}.`);
    this.loop.label(`Force against indentation: ${top}.`);
  }
}

const bracketed = (name: string) => (name.includes(" ") ? `(${name})` : name);

/** A band, phase by phase, so that it also follows a loop. */
function bandAreas({ lower, upper }: Band, grid: Grid, where: (step: number) => number, height: (force: number) => number, ink: Ink, name?: string): Area[] {
  const [onset, turn, last] = grid.ends;
  return [
    [0, onset],
    [onset, turn],
    [turn, last],
  ].map(([first, end], i) => ({
    name: i === 0 ? name : undefined,
    colour: ink.uncertain,
    points: Array.from({ length: end! - first! + 1 }, (_, k) => {
      const step = first! + k;
      return [where(step), height(lower[step]!), height(upper[step]!)] as const;
    }),
  }));
}

/** What the charts draw: the surrogate with its band, the solver, the pull-off, and the difference. */

import type { PullOff } from "./measures";
import type { Band } from "./model";
import type { Grid } from "./protocol";

export interface Picture {
  grid: Grid;
  force: Float64Array;
  pullOff: PullOff;
  /** Of a pretrained model. */
  band?: Band;
  /** The solver's force on the same steps, where there is one. */
  solver?: readonly number[];
  extrapolated: boolean;
  caption: string;
  /** The units of the numbers above. */
  names: { length: string; time: string; force: string };
}

/** Colours come from the style sheet, which knows about dark mode. */
export function colours() {
  const style = getComputedStyle(document.documentElement);
  const of = (name: string) => style.getPropertyValue(`--${name}`).trim();
  return {
    paper: of("surface"),
    text: of("text"),
    muted: of("muted"),
    line: of("line"),
    band: of("band"),
    surrogate: of("surrogate"),
    uncertain: `${of("surrogate")}40`,
    solver: of("solver"),
    peak: of("peak"),
    warn: of("warn"),
    path: of("path"),
    sphere: of("sphere"),
    solid: of("solid"),
    push: of("push"),
    pull: of("pull"),
    font: getComputedStyle(document.body).fontFamily,
  };
}
export type Ink = ReturnType<typeof colours>;

const still = { emphasis: { disabled: true } };

export function surrogateLine(data: number[][], extrapolated: boolean, colour: string) {
  return {
    type: "line",
    name: "surrogate",
    data,
    symbol: "circle",
    symbolSize: 4.5,
    showSymbol: true,
    lineStyle: { width: 1.6, type: extrapolated ? "dashed" : "solid" },
    color: colour,
    ...still,
    z: 3,
  };
}

export function solverLine(data: number[][], ink: Ink) {
  return { type: "line", name: "solver", data, symbol: "none", lineStyle: { width: 2.4 }, color: ink.solver, ...still, z: 2 };
}

/** A diamond at the pull-off, and the ends of its interval where it is finite. */
export function pullOffMarks(x: number, force: number, interval: readonly number[] | undefined, ink: Ink): object[] {
  const mark = { name: "pull-off", color: ink.peak, ...still, z: 4 };
  const marks: object[] = [{ ...mark, type: "scatter", data: [[x, force]], symbol: "diamond", symbolSize: 13 }];
  if (interval?.every(Number.isFinite)) {
    const ends = interval.map((value) => [x, value]);
    marks.push({ ...mark, type: "line", data: ends, symbol: "rect", symbolSize: [13, 2], lineStyle: { width: 2 } });
  }
  return marks;
}

interface Coordinates {
  coord(point: readonly number[]): number[];
}

/**
 * A shaded band, phase by phase, so that it also follows a loop; nothing where it is infinite.
 *
 * @param points Position, lower and upper end at each step.
 */
export function bandArea(points: readonly (readonly [number, number, number])[], grid: Grid, ink: Ink): object[] {
  if (!points.every((point) => point.every(Number.isFinite))) return [];
  const [onset, end, last] = grid.ends;
  const phases = [points.slice(0, onset + 1), points.slice(onset, end + 1), points.slice(end, last + 1)];
  // One shape is drawn for all points, which are data only for the axes to include them.
  const renderItem = ({ dataIndexInside }: { dataIndexInside: number }, { coord }: Coordinates) => {
    if (dataIndexInside > 0) return undefined;
    const children = phases.map((phase) => {
      const upper = phase.map(([x, , high]) => coord([x, high]));
      const lower = phase.map(([x, low]) => coord([x, low])).reverse();
      return { type: "polygon", shape: { points: [...upper, ...lower] }, style: { fill: ink.uncertain } };
    });
    return { type: "group", children };
  };
  const encode = { x: 0, y: [1, 2] };
  return [{ type: "custom", name: "90 % band", data: points, encode, renderItem, color: ink.uncertain, silent: true, clip: true, z: 1 }];
}

/** Surrogate minus solver, and the ends between which it lies where the solver lies in the band of the force. */
export function residuals({ force, band }: Picture, solver: readonly number[]) {
  const less = (values: Float64Array) => values.map((value, step) => force[step]! - value);
  const difference = force.map((value, step) => value - solver[step]!);
  return { difference, ends: band && { lower: less(band.upper), upper: less(band.lower) } };
}

/** Calibrated bands of the pretrained models. Mirrors `surrogate/prediction/bands.py`. */

import { QUANTITIES, type Protocol } from "./protocol";

/** As `surrogate export` writes them into the file of a model. */
export interface Bands {
  levels: number[];
  /** Low and high of each quantity. */
  ranges: number[][];
  /** Of the logarithm of the expected errors: pull-off, its time, hysteresis, force, curve. */
  coefficients: number[][];
  /** That divide the groups of expected errors. */
  edges: number[][];
  /** Of the force by group and step. */
  shape: number[][];
  /** By interval or band, cell and level. */
  quantiles: number[][][];
}

const OUTERMOST = 0.2;
const SMALLEST = 1e-4;
const FORCE = 3;

/** Read the bands of a file; undefined where there are none for so many steps. */
export function parseBands(text: string | undefined, steps: number): Bands | undefined {
  const rows = (values: unknown, ...shape: number[]): boolean => {
    const [size, ...others] = shape;
    if (size === undefined) return Number.isFinite(values);
    return Array.isArray(values) && values.length === size && values.every((value) => rows(value, ...others));
  };
  try {
    const bands = JSON.parse(text ?? "null") as Bands;
    const [levels, groups, known] = [bands.levels.length, bands.shape.length, QUANTITIES.length];
    const complete =
      rows(bands.levels, levels) &&
      rows(bands.ranges, known, 2) &&
      rows(bands.coefficients, FORCE + 2, ((known + 2) * (known + 3) * (known + 4)) / 6) &&
      rows(bands.edges, FORCE + 2, groups - 1) &&
      rows(bands.shape, groups, steps) &&
      rows(bands.quantiles, FORCE + 2, 2 ** known + groups, levels);
    return complete ? bands : undefined;
  } catch {
    return undefined;
  }
}

/**
 * Half-widths of the logarithm of the pull-off force, and of the scaled force at each step.
 *
 * @param sharpness By how much the higher neighbour of the highest step is less, as a share.
 * @param coverage The share of true values that the bands are to contain.
 */
export function halfWidths(
  bands: Bands,
  protocol: Protocol,
  sharpness: number,
  coverage: number,
): { pullOff: number; force: number[] } {
  const places = QUANTITIES.map((name, i) => {
    const [low, high] = bands.ranges[i]!.map(Math.log) as [number, number];
    return Math.min(Math.max((2 * Math.log(Math.max(protocol[name], SMALLEST)) - low - high) / (high - low), -1), 1);
  });
  const outermost = places.every((place) => Math.abs(place) >= 1 - 2 * OUTERMOST - 1e-9);
  const corner = places.reduce((sum, place, i) => sum + (place > 0 ? 2 ** i : 0), 0);
  const all = [1, ...places, 1 + Math.log(Math.max(sharpness, SMALLEST)) / 4];
  const terms = all.flatMap((one, i) =>
    all.slice(i).flatMap((other, j) => all.slice(i + j).map((third) => one * other * third)),
  );
  const { levels } = bands;
  const right = Math.min(Math.max(below(levels, coverage), 1), levels.length - 1);
  const part = (coverage - levels[right - 1]!) / (levels[right]! - levels[right - 1]!);
  const width = (row: number) => {
    const size = terms.reduce((total, term, i) => total + term * bands.coefficients[row]![i]!, 0);
    const group = below(bands.edges[row]!, size);
    const cell = bands.quantiles[row]![outermost ? corner : 2 ** places.length + group]!;
    return { group, half: Math.exp(size) * ((1 - part) * cell[right - 1]! + part * cell[right]!) };
  };
  const { group, half } = width(FORCE);
  return { pullOff: width(0).half, force: bands.shape[group]!.map((value) => half * value) };
}

/** How many of increasing values lie below one. */
function below(values: readonly number[], one: number): number {
  const found = values.findIndex((value) => value >= one);
  return found < 0 ? values.length : found;
}

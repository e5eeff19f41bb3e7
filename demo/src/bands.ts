/** Calibrated bands of the pretrained models. Mirrors `surrogate/pretrained/bands.py`. */

import { QUANTITIES, type Protocol } from "./protocol";

/** As `surrogate export` writes them into the file of a model. */
export interface Bands {
  levels: number[];
  coefficients: number[];
  edges: number[];
  /** By group of difficulty and level. */
  pull_off: number[][];
  /** By group of difficulty, level and step. */
  force: number[][][];
}

const HARDEST = 3;
const SMALLEST = 1e-4;

/** Read the bands of a file; undefined where there are none for so many steps. */
export function parseBands(text: string | undefined, steps: number): Bands | undefined {
  const rows = (values: unknown, ...shape: number[]): boolean => {
    const [size, ...others] = shape;
    if (size === undefined) return Number.isFinite(values);
    return Array.isArray(values) && values.length === size && values.every((value) => rows(value, ...others));
  };
  try {
    const bands = JSON.parse(text ?? "null") as Bands;
    const [levels, groups] = [bands.levels.length, bands.edges.length + 1];
    const complete =
      rows(bands.levels, levels) &&
      rows(bands.edges, groups - 1) &&
      rows(bands.coefficients, 1 + 2 * (QUANTITIES.length + 1)) &&
      rows(bands.pull_off, groups, levels) &&
      rows(bands.force, groups, levels, steps);
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
  const values = [...QUANTITIES.map((name) => protocol[name]), sharpness];
  const logs = values.map((value) => Math.log(Math.max(value, SMALLEST)));
  const terms = [1, ...logs, ...logs.map((log) => log * log)];
  const sum = terms.reduce((total, term, i) => total + term * bands.coefficients[i]!, 0);
  const difficulty = Math.min(sum, HARDEST);
  const group = below(bands.edges, difficulty);
  const { levels } = bands;
  const right = Math.min(Math.max(below(levels, coverage), 1), levels.length - 1);
  const part = (coverage - levels[right - 1]!) / (levels[right]! - levels[right - 1]!);
  const between = (low: number, high: number) => (1 - part) * low + part * high;
  const [low, high] = [bands.force[group]![right - 1]!, bands.force[group]![right]!];
  return {
    pullOff: between(bands.pull_off[group]![right - 1]!, bands.pull_off[group]![right]!) * Math.exp(difficulty),
    force: low.map((value, step) => between(value, high[step]!)),
  };
}

/** How many of increasing values lie below one. */
function below(values: readonly number[], one: number): number {
  const found = values.findIndex((value) => value >= one);
  return found < 0 ? values.length : found;
}

/** What the page asks of a surrogate, and what it gets. */

import type { PullOff } from "./measures";
import { QUANTITIES, type Grid, type Protocol, type Quantity } from "./protocol";

export type Ranges = Record<Quantity, readonly [number, number]>;

/** Where the solver's values are to be expected: at each step, and for the pull-off force. */
export interface Band {
  lower: Float64Array;
  upper: Float64Array;
  pullOff: readonly [number, number];
}

export interface Prediction {
  grid: Grid;
  force: Float64Array;
  pullOff: PullOff;
  hysteresis: number;
  /** Of `fast`. */
  band?: Band;
}

export interface Model {
  readonly name: string;
  /** Smallest and largest value of each quantity in the training. */
  readonly ranges: Ranges;
  /** Nothing where the training covers each quantity, but not their combination. */
  predict(protocol: Protocol): Promise<Prediction | undefined>;
}

// As in `surrogate/validity.py`: relative to the bound.
const RANGE_TOLERANCE = 1e-6;

/** Whether a positive quantity lies outside its training range, but for rounding. */
export function isOutside(value: number, low: number, high: number): boolean {
  return value < low * (1 - RANGE_TOLERANCE) || value > high * (1 + RANGE_TOLERANCE);
}

/** The quantities of a protocol that lie outside the training ranges. */
export function outside(protocol: Protocol, ranges: Ranges): Quantity[] {
  return QUANTITIES.filter((name) => isOutside(protocol[name], ...ranges[name]));
}

/** What is read off a force history, and how far two histories are apart. Mirrors `surrogate/data/metrics.py`. */

import { monotone } from "./monotone";
import type { Grid } from "./protocol";

export interface PullOff {
  /** The measurement step of the largest force. */
  step: number;
  force: number;
  time: number;
}

/** The largest force from the end of the dwell on. */
export function pullOff(grid: Grid, force: ArrayLike<number>): PullOff {
  let step = grid.ends[1];
  for (let i = step; i < force.length; i++) if (force[i]! > force[step]!) step = i;
  return { step, force: force[step]!, time: grid.times[step]! };
}

/** The loop area |closed integral of P dδ| by the trapezoidal rule. */
export function hysteresis(grid: Grid, force: ArrayLike<number>): number {
  let area = 0;
  for (let i = 1; i < force.length; i++) {
    area += 0.5 * (force[i]! + force[i - 1]!) * (grid.indentations[i]! - grid.indentations[i - 1]!);
  }
  return Math.abs(area);
}

/**
 * The force of a history at the steps of another one of the same protocol, by monotone cubics in each phase. Of a
 * protocol from a link, which is rounded, instants are compared as shares of their phase.
 */
export function atSteps(steps: Grid, grid: Grid, force: readonly number[]): Float64Array {
  const found = new Float64Array(steps.times.length);
  for (const phase of [0, 1, 2]) {
    const [[first, at], [from, places]] = [shares(steps, phase), shares(grid, phase)];
    found.set(monotone(at, places, force.slice(from, from + places.length)), first);
  }
  return found;
}

/** The first step of a phase, and where its steps lie in it, from 0 to 1. */
function shares({ times, ends }: Grid, phase: number): [number, Float64Array] {
  const first = ends[phase - 1] ?? 0;
  const own = times.subarray(first, ends[phase]! + 1);
  return [first, own.map((time) => (time - own[0]!) / (own.at(-1)! - own[0]!))];
}

/** 100 Σ|a - b| / Σ|b|, in percent. */
export function forceError(predicted: ArrayLike<number>, reference: ArrayLike<number>): number {
  let difference = 0;
  let size = 0;
  for (let i = 0; i < reference.length; i++) {
    difference += Math.abs(predicted[i]! - reference[i]!);
    size += Math.abs(reference[i]!);
  }
  return (100 * difference) / size;
}

/** 100 |a - b| / |b|, in percent. */
export function relativeError(predicted: number, reference: number): number {
  return (100 * Math.abs(predicted - reference)) / Math.abs(reference);
}

export function median(values: readonly number[]): number {
  const sorted = [...values].sort((a, b) => a - b);
  const middle = sorted.length >> 1;
  return sorted.length % 2 ? sorted[middle]! : 0.5 * (sorted[middle - 1]! + sorted[middle]!);
}

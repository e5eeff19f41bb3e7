/**
 * What is read off a force history, and how far two histories are apart. Mirrors `surrogate/data/metrics.py`, and for
 * the physical steps `surrogate/pretrained/kernels.py` and `bem/_support/monotone.py`.
 */

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

/** The top of the parabola through the highest step and its neighbours, and by how much the higher one is less. */
export function smoothPullOff(grid: Grid, force: ArrayLike<number>): PullOff & { sharpness: number } {
  const found = { ...pullOff(grid, force), sharpness: 0 };
  const { step } = found;
  if (step === grid.ends[1] || step === grid.ends[2]) return found;
  const [last, here, next] = [force[step - 1]!, force[step]!, force[step + 1]!];
  const [before, after] = [found.time - grid.times[step - 1]!, grid.times[step + 1]! - found.time];
  const [rise, fall] = [(here - last) / before, (next - here) / after];
  const bend = (fall - rise) / (before + after);
  found.sharpness = 1 - Math.max(last, next) / Math.max(here, 1e-300);
  if (bend < 0) {
    const slope = rise + bend * before;
    found.force -= (0.25 * slope * slope) / bend;
    found.time -= (0.5 * slope) / bend;
  }
  return found;
}

/** The loop area |closed integral of P dδ| by the trapezoidal rule. */
export function hysteresis(grid: Grid, force: ArrayLike<number>): number {
  let area = 0;
  for (let i = 1; i < force.length; i++) {
    area += 0.5 * (force[i]! + force[i - 1]!) * (grid.indentations[i]! - grid.indentations[i - 1]!);
  }
  return Math.abs(area);
}

/** The loop area by monotone cubics through the steps of loading and of unloading. */
export function smoothHysteresis(grid: Grid, force: ArrayLike<number>): number {
  const { times, indentations, ends } = grid;
  let work = 0;
  for (const [first, last] of [
    [0, ends[0]],
    [ends[1], ends[2]],
  ] as const) {
    const time = times.subarray(first, last + 1);
    const part = Float64Array.from({ length: time.length }, (_, i) => force[first + i]!);
    const rate = (indentations[last]! - indentations[first]!) / (times[last]! - times[first]!);
    work -= monotoneIntegral(time, part) * rate;
  }
  return Math.abs(work);
}

function monotoneIntegral(times: Float64Array, force: Float64Array): number {
  const slopes = monotoneSlopes(times, force);
  let total = 0;
  for (let i = 0; i < times.length - 1; i++) {
    const width = times[i + 1]! - times[i]!;
    total += width * (0.5 * (force[i]! + force[i + 1]!) + (width * (slopes[i]! - slopes[i + 1]!)) / 12);
  }
  return total;
}

/** Slopes of cubics that do not overshoot, after Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5 (1984) 300. */
function monotoneSlopes(times: Float64Array, force: Float64Array): Float64Array {
  const last = times.length - 1;
  const width = (i: number) => times[i + 1]! - times[i]!;
  const chord = (i: number) => (force[i + 1]! - force[i]!) / width(i);
  const slopes = new Float64Array(times.length);
  for (let i = 1; i < last; i++) {
    if (chord(i - 1) * chord(i) <= 0) continue;
    const weight = 2 * width(i) + width(i - 1);
    const nextWeight = width(i) + 2 * width(i - 1);
    slopes[i] = (weight + nextWeight) / (weight / chord(i - 1) + nextWeight / chord(i));
  }
  for (const [end, near, far] of [
    [0, 0, 1],
    [last, last - 1, last - 2],
  ] as const) {
    const [own, other] = [chord(near), chord(far)];
    const slope = ((2 * width(near) + width(far)) * own - width(near) * other) / (width(near) + width(far));
    const overshoots = own * other <= 0 && Math.abs(slope) > 3 * Math.abs(own);
    slopes[end] = slope * own <= 0 ? 0 : overshoots ? 3 * own : slope;
  }
  return slopes;
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

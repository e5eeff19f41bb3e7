/**
 * How far the model may be wrong, and which contacts its training covers. Mirrors `surrogate/intervals.py`, for
 * standard linear solids and elastic ones, and `surrogate/data/reach.py`.
 */

import { polynomial, standardised, type Arrays } from "./network";

/** How far outside its range a feature may lie, in widths of it. */
const TOLERANCE = 1e-3;

/** Half-widths of the targets and, as multiples of the shape, of the force at each step and of the whole curve. */
export function halfWidths(features: readonly number[], elastic: boolean, arrays: Arrays): { half: number[]; shape: Float64Array } {
  const { edges, quantiles, shape } = arrays;
  const sizes = [...polynomial(standardised(features, arrays), arrays["coefficients"]!)];
  const bounds = edges!.length / sizes.length;
  const groups = sizes.map((size, i) => edges!.subarray(i * bounds, (i + 1) * bounds).filter((edge) => edge < size).length);
  const step = sizes.length - 2;
  const own = quantiles!.subarray(elastic ? quantiles!.length / 2 : 0);
  const half = sizes.map((size, i) => Math.exp(size) * own[i * (bounds + 1) + groups[i]!]!);
  const steps = shape!.length / (bounds + 1);
  return { half, shape: shape!.subarray(groups[step]! * steps, (groups[step]! + 1) * steps) };
}

/** Whether the training covers the features: each by itself, and all of them together. */
export function covered(features: readonly number[], { low, high, mean, whitening, limit }: Arrays): boolean {
  const away = features.map((value, i) => Math.max(low![i]! - value, value - high![i]!) / Math.max(high![i]! - low![i]!, 1e-9));
  const count = features.length;
  const white = features.map((_, j) => features.reduce((sum, value, i) => sum + (value - mean![i]!) * whitening![i * count + j]!, 0));
  const distance = Math.sqrt(white.reduce((sum, value) => sum + value * value, 0) / count) / limit![0]!;
  return Math.max(...away) <= TOLERANCE && distance <= 1;
}

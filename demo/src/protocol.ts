/**
 * What a loading protocol on a solid is and where it is sampled: load to a peak, dwell, unload to the start, with a
 * fixed number of equally spaced measurement steps in each phase. Mirrors `bem/problem/protocol.py` and
 * `bem/dataset/measurement_steps.py`; `pull_off_steps.ts` has the steps of the pretrained model.
 *
 * Units: indentation in h0, time in retardation times, rates in h0 per retardation time.
 */

export const QUANTITIES = [
  "tabor",
  "peak_indentation",
  "loading_rate",
  "dwell_time",
  "unloading_rate",
  "modulus_ratio",
] as const;
export type Quantity = (typeof QUANTITIES)[number];
export type Protocol = Record<Quantity, number>;
export type Counts = readonly [number, number, number];

export interface Grid {
  times: Float64Array;
  indentations: Float64Array;
  /** One at the first and the last point of the dwell, zero elsewhere. */
  edge: Float64Array;
  /** Index of the last point of loading, of the dwell and of unloading. */
  ends: readonly [number, number, number];
}

export const LABELS: Record<Quantity, { name: string; brief: string; symbol: string; unit: string }> = {
  tabor: { name: "Tabor parameter", brief: "μ", symbol: "μ", unit: "" },
  peak_indentation: { name: "Peak indentation", brief: "peak", symbol: "δ_l", unit: "h₀" },
  loading_rate: { name: "Loading rate", brief: "loading", symbol: "v_L", unit: "h₀/τ" },
  dwell_time: { name: "Dwell time", brief: "dwell", symbol: "t_D", unit: "τ" },
  unloading_rate: { name: "Unloading rate", brief: "unloading", symbol: "v_U", unit: "h₀/τ" },
  modulus_ratio: { name: "Modulus ratio", brief: "k", symbol: "k", unit: "" },
};

/** The paper's initial indentation -π^(2/3) μ. */
export function startIndentation(tabor: number): number {
  return -Math.pow(Math.PI, 2 / 3) * tabor;
}

/** Instants and indentations at start, end of loading, end of the dwell, and end. */
export function corners(protocol: Protocol): { times: number[]; indentations: number[] } {
  const { tabor, peak_indentation: peak, loading_rate: up, dwell_time: dwell, unloading_rate: down } = protocol;
  const start = startIndentation(tabor);
  const travel = peak - start;
  const onset = travel / up;
  return { times: [0, onset, onset + dwell, onset + dwell + travel / down], indentations: [start, peak, peak, start] };
}

const SMALLEST = 1e-5;
const LARGEST = 1e5;

/** Why a value is no use as a quantity of a protocol; undefined where it is. */
export function complaint(value: number, quantity: Quantity): string | undefined {
  if (!Number.isFinite(value)) return "Give a number.";
  // The relaxed modulus is no larger than the instantaneous one.
  const largest = quantity === "modulus_ratio" ? 1 : LARGEST;
  if (value < SMALLEST || value > largest) return `Give a number from ${SMALLEST} to ${largest}.`;
  return undefined;
}

/** The ends of the phases, and the marks of the dwell. */
export function phases([loading, dwell, unloading]: Counts): Pick<Grid, "edge" | "ends"> {
  const ends = [loading - 1, loading + dwell - 1, loading + dwell + unloading - 1] as const;
  const edge = new Float64Array(ends[2] + 1);
  edge[ends[0]] = 1;
  edge[ends[1]] = 1;
  return { edge, ends };
}

/** Sample a protocol on the fixed measurement steps. */
export function measurementGrid(protocol: Protocol, counts: Counts): Grid {
  const [loading, dwell, unloading] = counts;
  const start = startIndentation(protocol.tabor);
  const peak = protocol.peak_indentation;
  const [, t1, t2, t3] = corners(protocol).times as [number, number, number, number];
  const steps = loading + dwell + unloading;
  const times = new Float64Array(steps);
  const indentations = new Float64Array(steps);
  const set = (index: number, time: number, rise: number) => {
    times[index] = time;
    // Weights rather than differences, so that peak and start are met exactly.
    indentations[index] = start * (1 - rise) + peak * rise;
  };
  for (let i = 0; i < loading; i++) set(i, (t1 * i) / (loading - 1), i / (loading - 1));
  for (let i = 1; i <= dwell; i++) set(loading + i - 1, t1 + ((t2 - t1) * i) / dwell, 1);
  for (let i = 1; i <= unloading; i++) {
    set(loading + dwell + i - 1, t2 + ((t3 - t2) * i) / unloading, 1 - i / unloading);
  }
  return { times, indentations, ...phases(counts) };
}

/** Interpolate linearly between points with increasing `places`; constant beyond them. */
export function linearly(at: number, places: ArrayLike<number>, values: ArrayLike<number>): number {
  const last = places.length - 1;
  if (at < places[0]!) return values[0]!;
  if (at >= places[last]!) return values[last]!;
  let [low, high] = [0, last];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (places[middle]! <= at) low = middle;
    else high = middle;
  }
  return values[low]! + ((values[high]! - values[low]!) / (places[high]! - places[low]!)) * (at - places[low]!);
}

/** The place of the value nearest to one that is wanted. */
export function nearest(values: readonly number[], wanted: number): number {
  return values.reduce((best, value, i) => (Math.abs(value - wanted) < Math.abs(values[best]! - wanted) ? i : best), 0);
}

/** Whether two protocols are the same but for rounding. */
export function sameProtocol(a: Protocol, b: Protocol): boolean {
  return QUANTITIES.every((name) => Math.abs(a[name] - b[name]) <= 1e-6 * Math.abs(b[name]));
}

/**
 * Measurement steps around a pull-off that is known, one of them at the pull-off itself. Mirrors
 * `bem/dataset/pull_off_steps.py`, whose docstring states the rule, for one standard linear solid.
 */

import { approach, type Path } from "./lee_radok";
import { linearly, nearest, phases, startIndentation, type Counts, type Grid, type Protocol } from "./protocol";

const FIRST = 0.05;
/** The share of the unloading points before the crossing. */
const BEFORE = 0.22;
const RANGES = [-1.2, -0.4, -0.12, 0, 0.12, 0.4];
const SHARES = [0, 0.08, 0.2, 0.32, 0.5, 0.68, 0.8, 1];

/** Sample a protocol on the steps around its pull-off. */
export function pullOffGrid(protocol: Protocol, counts: Counts, pullOffTime: number): Grid {
  const { tabor, peak_indentation: peak, loading_rate: up, dwell_time: dwelt, unloading_rate: down } = protocol;
  const [loading, dwell, unloading] = counts;
  const start = startIndentation(tabor);
  const onset = (peak - start) / up;
  const turn = onset + dwelt;
  const path = approach(protocol);
  const parts = Array.from({ length: loading }, (_, i) => i / (loading - 1));
  const held = spread(path.dwell, dwell);
  const travels = travelled(path.unloading, peak - start, (pullOffTime - turn) * down, unloading);
  const indentations = [
    ...parts.map((part) => start * (1 - part) + peak * part),
    ...held.map(() => peak),
    ...travels.map((travel) => peak - travel),
  ];
  indentations[indentations.length - 1] = start;
  const times = [
    ...parts.map((part) => onset * part),
    ...held.map((after) => onset + after),
    ...travels.map((travel) => turn + travel / down),
  ];
  return { times: Float64Array.from(times), indentations: Float64Array.from(indentations), ...phases(counts) };
}

/** Travels from the peak to the start. */
function travelled(unloading: Path, room: number, wanted: number, count: number): number[] {
  const crossing = unloading.where.at(-1)!;
  const before = Math.max(Math.floor(BEFORE * count + 0.5), 1);
  const travels = spread(unloading, before);
  const pullOff = Math.min(Math.max(wanted, 1e-3 * travels[0]!), room);
  travels.push(...offsets(room - crossing, pullOff - crossing, count - before).map((offset) => crossing + offset));
  travels[count - 1] = room;
  // One step lies at the pull-off, also where it comes before or barely after the crossing.
  travels[nearest(travels, pullOff)] = pullOff;
  return travels;
}

/** `count` of increasing positions, the last included, spaced half by them, half by the change of the force. */
function spread({ where, force }: Path, count: number): number[] {
  const last = where.length - 1;
  let total = 1e-300;
  for (let i = 1; i <= last; i++) total += Math.abs(force[i]! - force[i - 1]!);
  const cumulated = [0];
  for (let i = 1; i <= last; i++) {
    const [way, change] = [where[i]! - where[i - 1]!, Math.abs(force[i]! - force[i - 1]!)];
    cumulated.push(cumulated[i - 1]! + (0.5 * way) / (where[last]! - where[0]!) + (0.5 * change) / total);
  }
  return Array.from({ length: count }, (_, i) => linearly(((i + 1) / count) * cumulated[last]!, cumulated, where));
}

/** Offsets below the crossing, the last one down to the start. */
function offsets(room: number, pullOff: number, count: number): number[] {
  const last = Math.log(room);
  const expected = Math.min(Math.log(Math.max(pullOff, 1e-300)), last);
  const knots = [Math.min(Math.log(FIRST), last - 3)];
  RANGES.forEach((range, i) => {
    knots.push(Math.min(Math.max(expected + range, knots[i]! + 0.05), last - 0.05 * (RANGES.length - i)));
  });
  knots.push(last);
  const places = SHARES.map((share) => Math.round(share * (count - 1)));
  return Array.from({ length: count }, (_, i) => Math.exp(linearly(i, places, knots)));
}

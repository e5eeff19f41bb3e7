/**
 * Measurement steps that follow the physics, most of them where the contact separates: the steps of the pretrained
 * models. Mirrors `bem/dataset/physical_steps.py` for one standard linear solid, whose docstring states the rule.
 */

import { coefficients as PLACE } from "../../bem/dataset/pull_off_place.json";
import { linearly, phases, startIndentation, type Counts, type Grid, type Protocol } from "./protocol";
import { Trouble } from "./trouble";

const FIRST = 0.05;
const BEFORE = 0.22;
const RANGES = [-1.2, -0.4, -0.12, 0.12, 0.4];
const SHARES = [0.0, 0.08, 0.2, 0.32, 0.68, 0.8, 1.0];
const LEAST_SLOPE = 0.3;
const DEGREE = 4;
const even = (last: number, count: number) => Float64Array.from({ length: count }, (_, i) => (last * i) / (count - 1));
const LOADING = even(1, 41);
const DWELL = Float64Array.from([0, ...even(12, 40).map((power) => Math.exp(power - 12))]);
const UNLOADING = even(6, 81).map((power) => Math.sinh(power) / Math.sinh(6));

/** Positions in a phase, and the force of Lee and Radok there. */
interface Path {
  where: Float64Array;
  force: Float64Array;
}

/**
 * Sample a protocol on the physical steps.
 *
 * @throws Trouble where instants cannot be told apart.
 */
export function physicalGrid(protocol: Protocol, counts: Counts): Grid {
  const { tabor, peak_indentation: peak, loading_rate: up, dwell_time: dwelt, unloading_rate: down } = protocol;
  const [loading, dwell, unloading] = counts;
  const start = startIndentation(tabor);
  const solid = new Solid(protocol.modulus_ratio);
  const steps = loading + dwell + unloading;
  const times = new Float64Array(steps);
  const indentations = new Float64Array(steps);
  const onset = (peak - start) / up;
  const turn = onset + dwelt;
  for (let i = 0; i < loading; i++) {
    const part = i / (loading - 1);
    times[i] = onset * part;
    indentations[i] = start * (1 - part) + peak * part;
  }
  for (let i = 1; i < LOADING.length; i++) {
    const [low, high] = [peak * LOADING[i - 1]!, peak * LOADING[i]!];
    solid.carry((high - low) / up, hertz(high) - hertz(low));
  }
  const held = holding(solid, peak, dwelt);
  spread(held, dwell).forEach((after, i) => {
    times[loading + i] = onset + after;
    indentations[loading + i] = peak;
  });
  const { path, crossing, slope } = leaving(solid, peak, down);
  const before = Math.max(Math.floor(BEFORE * unloading + 0.5), 1);
  const travel = new Float64Array(unloading);
  travel.set(spread(path, before));
  const steep = Math.max(slope, 0) + LEAST_SLOPE;
  const features = [tabor, down, protocol.modulus_ratio, crossing - start, steep, (peak - crossing) / peak];
  offsets(crossing - start, expected(features.map(Math.log)), unloading - before).forEach((offset, i) => {
    travel[before + i] = peak - crossing + offset;
  });
  travel[unloading - 1] = peak - start;
  travel.forEach((distance, i) => {
    times[loading + dwell + i] = turn + distance / down;
    indentations[loading + dwell + i] = peak - distance;
  });
  indentations[steps - 1] = start;
  if (times.some((time, i) => i > 0 && !(time > times[i - 1]!))) {
    throw new Trouble("These phases are too different in length for the measurement steps to be told apart.");
  }
  return { times, indentations, ...phases(counts) };
}

/** A standard linear solid with its memory of the force of Hertz: E(t)/E0 = 1 + strength exp(-rate t). */
class Solid {
  private readonly strength: number;
  private readonly rate: number;
  private memory = 0;

  constructor(modulusRatio: number) {
    this.rate = 1 / modulusRatio;
    this.strength = this.rate - 1;
  }

  /** Carry the memory over a step in which the force of Hertz changes linearly. */
  carry(duration: number, change: number): void {
    const lost = -Math.expm1(-this.rate * duration);
    this.memory += (lost / (this.rate * duration)) * change - lost * this.memory;
  }

  force(indentation: number): number {
    return hertz(indentation) + this.strength * this.memory;
  }

  /** Slope of the force over the indentation while this falls at a speed. */
  slope(indentation: number, speed: number): number {
    return 1.5 * Math.sqrt(indentation) * (1 + this.strength) + (this.strength * this.rate * this.memory) / speed;
  }
}

function hertz(indentation: number): number {
  return indentation > 0 ? indentation * Math.sqrt(indentation) : 0;
}

function holding(solid: Solid, peak: number, dwelt: number): Path {
  const where = DWELL.map((part) => dwelt * part);
  const force = where.map((instant, i) => {
    if (i > 0) solid.carry(instant - where[i - 1]!, 0);
    return solid.force(peak);
  });
  return { where, force };
}

/** Travels of the unloading up to where the force vanishes, that indentation, and the slope of the force there. */
function leaving(solid: Solid, peak: number, down: number): { path: Path; crossing: number; slope: number } {
  const where = [0];
  const force = [solid.force(peak)];
  let slope = solid.slope(peak, down);
  const path = () => ({ where: Float64Array.from(where), force: Float64Array.from(force) });
  for (let i = 1; i < UNLOADING.length; i++) {
    const travel = peak * UNLOADING[i]!;
    const left = Math.max(peak - travel, 0);
    solid.carry((travel - where[i - 1]!) / down, hertz(left) - hertz(peak - where[i - 1]!));
    const here = solid.force(left);
    const before = slope;
    slope = solid.slope(left, down);
    if (here <= 0) {
      const last = where[i - 1]!;
      const part = force[i - 1]! / (force[i - 1]! - here);
      where.push(last + part * (travel - last));
      force.push(0);
      return { path: path(), crossing: peak - where[i]!, slope: before + part * (slope - before) };
    }
    where.push(travel);
    force.push(here);
  }
  return { path: path(), crossing: 0, slope };
}

/** `count` of increasing positions, the last included, spaced half by them, half by the change of the force. */
function spread({ where, force }: Path, count: number): Float64Array {
  const last = where.length - 1;
  let total = 1e-300;
  for (let i = 1; i <= last; i++) total += Math.abs(force[i]! - force[i - 1]!);
  const cumulated = new Float64Array(where.length);
  for (let i = 1; i <= last; i++) {
    cumulated[i] =
      cumulated[i - 1]! +
      (0.5 * (where[i]! - where[i - 1]!)) / (where[last]! - where[0]!) +
      (0.5 * Math.abs(force[i]! - force[i - 1]!)) / total;
  }
  const found = Float64Array.from({ length: count }, (_, i) =>
    linearly(((i + 1) / count) * cumulated[last]!, cumulated, where),
  );
  if (count) found[count - 1] = where[last]!;
  return found;
}

/** The expected logarithm of the pull-off's offset: a polynomial, its terms in the order of Python's combinations. */
function expected(features: number[]): number {
  let total = 0;
  let term = 0;
  const add = (first: number, product: number, size: number) => {
    if (size === 0) {
      total += PLACE[term++]! * product;
      return;
    }
    for (let i = first; i < features.length; i++) add(i, product * features[i]!, size - 1);
  };
  for (let size = 0; size <= DEGREE; size++) add(0, 1, size);
  return total;
}

/** Offsets below the crossing, the last one down to the start. */
function offsets(room: number, place: number, count: number): Float64Array {
  const last = Math.log(room);
  const knots = [Math.min(Math.log(FIRST), last - 3)];
  RANGES.forEach((range, i) => {
    const bound = Math.min(place, last) + range;
    knots.push(Math.min(Math.max(bound, knots[i]! + 0.05), last - 0.05 * (RANGES.length - i)));
  });
  knots.push(last);
  const found = Float64Array.from({ length: count }, (_, i) => Math.exp(linearly(i / (count - 1), SHARES, knots)));
  found[count - 1] = room;
  return found;
}

/**
 * Features of a contact: what its very solid does along the protocol. Mirrors `surrogate/data/solid_features.py`, which
 * names and explains them, for one standard linear solid.
 */

import { approach, hertz, type Solid } from "./lee_radok";
import { startIndentation, type Grid, type Protocol } from "./protocol";

const decades = (from: number, to: number, count: number) =>
  Array.from({ length: count }, (_, i) => 10 ** (from + ((to - from) * i) / (count - 1)));
const CRACK = decades(-2, 2, 9);
const LOADED = decades(-2, 2, 5);
const RECOVERED = decades(-1.5, 1.5, 7);
const BEYOND = [0.3, 1, 3, 10, 30];
const PIECES = 4;
const TINY = 1e-9;

export function solidFeatures(protocol: Protocol): number[] {
  // An elastic contact knows no time.
  const timeless = { loading_rate: 1, dwell_time: 1, unloading_rate: 1 };
  const timed = protocol.modulus_ratio < 1 ? protocol : { ...protocol, ...timeless };
  const { tabor, peak_indentation: peak, loading_rate: up, dwell_time: dwelt, unloading_rate: down, modulus_ratio: ratio } = timed;
  const { solid, peakForce, work: pressing, dwell, unloading, slope } = approach(timed);
  const { where, force } = unloading;
  const travel = where.at(-1)!;
  const [whole, crossing, since] = [hertz(peak), peak - travel, travel / down];
  let work = pressing;
  for (let i = 1; i < where.length; i++) work -= 0.5 * (force[i]! + force[i - 1]!) * (where[i]! - where[i - 1]!);
  const creep = (time: number) => Math.log(Math.max(1 - (1 - ratio) * Math.exp(-time), TINY));
  const regained = (length: number) => solid.strength * solid.memory * Math.expm1((-length / down) * solid.rate);
  return [
    ...[Math.log(tabor), Math.log(peak), Math.log(up / down), Math.log(dwelt * down), creep(0)],
    ...[Math.log(peakForce / whole), Math.log(dwell.force.at(-1)! / whole)],
    ...[Math.log(travel / peak), Math.log(crossing - startIndentation(tabor)), Math.log(Math.max(slope, 0) + 0.3)],
    ...[Math.log(Math.max(work, TINY) + 1e-3 * whole * peak), Math.log(crossing + 0.3)],
    Math.log(1 + solid.strength * Math.exp(-since * solid.rate)),
    Math.log(halved(where, force) / peak + 1e-3),
    ...[creep(since), creep(since + dwelt), creep(since + dwelt + peak / up)],
    ...CRACK.map((length) => creep(length / down)),
    ...LOADED.map((length) => creep(length / up)),
    ...RECOVERED.map((length) => Math.log(Math.max(regained(length), 0) + 1e-2)),
    ...BEYOND.map((offset) => Math.asinh(carriedOn(solid, crossing, offset, down))),
  ];
}

/** The travel at which half of the force is left. */
function halved(where: Float64Array, force: Float64Array): number {
  const half = 0.5 * force[0]!;
  let i = 1;
  while (force[i]! > half) i++;
  const share = (force[i - 1]! - half) / (force[i - 1]! - force[i]!);
  return where[i - 1]! + share * (where[i]! - where[i - 1]!);
}

/** Force without adhesion at an offset below the crossing, where it is a tension. */
function carriedOn(crossed: Solid, crossing: number, offset: number, down: number): number {
  const [solid, depth] = [crossed.copy(), Math.min(offset, crossing)];
  for (let piece = 0; piece < PIECES && depth > 0; piece++) {
    const [high, low] = [piece, piece + 1].map((end) => crossing - (depth * end) / PIECES) as [number, number];
    solid.carry((high - low) / down, hertz(low) - hertz(high));
  }
  const left = Math.exp((-(offset - depth) / down) * solid.rate);
  return hertz(crossing - offset) + solid.strength * solid.memory * left;
}

/** Force of Lee and Radok, in that of adhesion and positive in tension, at steps; zero once it crosses. */
export function forcesWithoutAdhesion({ times, indentations }: Grid, solid: Solid, tabor: number): Float64Array {
  const unit = (-4 / (3 * Math.PI)) * Math.pow(tabor, -1.5);
  return indentations.map((here, i) => {
    if (i === 0) return 0;
    solid.carry(times[i]! - times[i - 1]!, hertz(here) - hertz(indentations[i - 1]!));
    return unit * Math.max(solid.force(here), 0);
  });
}

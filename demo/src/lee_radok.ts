/**
 * The force of Lee and Radok without adhesion along a protocol on a standard linear solid. Mirrors
 * `bem/dataset/lee_radok.py`, whose docstring states it, for one retardation term of time 1.
 *
 * Units: forces in those of the relaxed Hertz force at indentation 1; otherwise as in `protocol.ts`.
 */

import type { Protocol } from "./protocol";

const even = (last: number, count: number) => Float64Array.from({ length: count }, (_, i) => (last * i) / (count - 1));
const LOADING = even(1, 41);
const DWELL = Float64Array.from([0, ...even(12, 40).map((power) => Math.exp(power - 12))]);
const UNLOADING = even(6, 81).map((power) => Math.sinh(power) / Math.sinh(6));

/** Positions in a phase, and the force there. */
export interface Path {
  where: Float64Array;
  force: Float64Array;
}

/** The indentation to the power 3/2 in contact, otherwise zero. */
export function hertz(indentation: number): number {
  return indentation > 0 ? indentation * Math.sqrt(indentation) : 0;
}

/** A standard linear solid with its memory of the force of Hertz: E(t)/E0 = 1 + strength exp(-rate t). */
export class Solid {
  readonly strength: number;
  readonly rate: number;

  constructor(
    private readonly modulusRatio: number,
    public memory = 0,
  ) {
    this.rate = 1 / modulusRatio;
    this.strength = (1 - modulusRatio) / modulusRatio;
  }

  copy(): Solid {
    return new Solid(this.modulusRatio, this.memory);
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

/** A protocol up to where the force vanishes in the unloading. */
export interface Approach {
  /** With its memory at the crossing. */
  solid: Solid;
  peakForce: number;
  /** Of loading. */
  work: number;
  /** Instants since the peak. */
  dwell: Path;
  /** Travels from the peak, the last one that to the crossing. */
  unloading: Path;
  /** Of the force in the indentation, at the crossing. */
  slope: number;
}

/** Follow a protocol from contact until the force vanishes in the unloading, or until the indentation does. */
export function approach({ peak_indentation: peak, loading_rate: up, dwell_time: dwelt, unloading_rate: down, modulus_ratio: ratio }: Protocol): Approach {
  const solid = new Solid(ratio);
  let [work, peakForce] = [0, 0];
  for (let i = 1; i < LOADING.length; i++) {
    const [low, high] = [peak * LOADING[i - 1]!, peak * LOADING[i]!];
    solid.carry((high - low) / up, hertz(high) - hertz(low));
    work += 0.5 * (peakForce + solid.force(high)) * (high - low);
    peakForce = solid.force(high);
  }
  const where = DWELL.map((part) => dwelt * part);
  const force = where.map((instant, i) => {
    if (i > 0) solid.carry(instant - where[i - 1]!, 0);
    return solid.force(peak);
  });
  return { solid, peakForce, work, dwell: { where, force }, ...unload(solid, peak, down) };
}

function unload(solid: Solid, peak: number, down: number): Pick<Approach, "unloading" | "slope"> {
  const [where, force] = [[0], [solid.force(peak)]];
  let slope = solid.slope(peak, down);
  for (let i = 1; i < UNLOADING.length && force[i - 1]! > 0; i++) {
    const [last, before] = [where[i - 1]!, { memory: solid.memory, slope }];
    const to = (travel: number) => {
      solid.memory = before.memory;
      solid.carry((travel - last) / down, hertz(peak - travel) - hertz(peak - last));
      return solid.force(peak - travel);
    };
    let travel = peak * UNLOADING[i]!;
    const here = to(travel);
    slope = solid.slope(Math.max(peak - travel, 0), down);
    if (here <= 0) {
      const share = force[i - 1]! / (force[i - 1]! - here);
      travel = last + share * (travel - last);
      slope = before.slope + share * (slope - before.slope);
      to(travel);
    }
    where.push(travel);
    force.push(Math.max(here, 0));
  }
  return { unloading: { where: Float64Array.from(where), force: Float64Array.from(force) }, slope };
}

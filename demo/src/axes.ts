/** Axes of the charts: time by phase or to scale, linear or signed logarithmic force. */

import { evenAxis, type Axis } from "./chart";
import { significant } from "./format";
import { corners, type Protocol } from "./protocol";

export const VIEWS = {
  /** `phases`: linear within each phase, which is as wide as the logarithm of its length; `real`: true to scale. */
  time: ["phases", "real"],
  force: ["linear", "log"],
  units: ["dimensionless", "laboratory"],
} as const;
export type View = { [axis in keyof typeof VIEWS]: (typeof VIEWS)[axis][number] };
export const USUAL_VIEW: View = { time: "phases", force: "linear", units: "dimensionless" };

// A phase of this length has no width; those of a protocol are longer.
const SHORTEST = 2e-4;
const NARROWEST = 0.4;

/** Where instants of a protocol stand on the axis of time. */
export class TimeScale {
  readonly corners: readonly number[];
  /** Places of the corners. */
  readonly places: readonly number[];

  constructor(
    protocol: Protocol,
    private readonly kind: View["time"],
  ) {
    this.corners = corners(protocol).times;
    const places = [0];
    for (let i = 1; i < 4; i++) places.push(places[i - 1]! + this.width(this.corners[i]! - this.corners[i - 1]!));
    this.places = places;
  }

  /** The width of a phase of a duration. */
  width(duration: number): number {
    return this.kind === "real" ? duration : Math.max(Math.log10(duration / SHORTEST), NARROWEST);
  }

  /** The inverse of `width`. */
  duration(width: number): number {
    return this.kind === "real" ? width : SHORTEST * 10 ** Math.max(width, NARROWEST);
  }

  place(time: number): number {
    return this.kind === "real" ? time : between(time, this.corners, this.places);
  }

  /** The inverse of `place`. */
  instant(place: number): number {
    return this.kind === "real" ? place : between(place, this.places, this.corners);
  }

  /** @param end The last place, more than that of the protocol while a corner is dragged or another one is longer. */
  axis(end: number, size: number, name?: string): Axis {
    const base = { low: 0, high: end, name: name && (this.kind === "real" ? name : `${name}, scale differs by phase`) };
    if (this.kind === "real") {
      const { ticks } = evenAxis([0, end], size);
      return { ...base, ticks: ticks.filter(({ place }) => place <= end) };
    }
    return { ...base, ticks: this.places.map((place, i) => ({ place, label: significant(this.corners[i]! * size, 3) })) };
  }

  phases() {
    const names = ["loading", "dwell", "unloading"];
    return names.map((name, i) => ({ name, from: this.places[i]!, to: this.places[i + 1]!, shaded: i === 1 }));
  }
}

/** Piecewise linear between four corners. */
function between(at: number, from: readonly number[], to: readonly number[]): number {
  const phase = at <= from[1]! ? 0 : at <= from[2]! ? 1 : 2;
  const share = (at - from[phase]!) / (from[phase + 1]! - from[phase]!);
  return to[phase]! + share * (to[phase + 1]! - to[phase]!);
}

/** sign(x) log10(1 + |x|): linear near zero, logarithmic far from it. */
function toSignedLog(value: number): number {
  return Math.sign(value) * Math.log10(1 + Math.abs(value));
}

/** An axis of force through values; `height` gives the place of one. */
export function forceAxis(values: readonly number[], kind: View["force"], size: number): { axis: Axis; height: (value: number) => number } {
  if (kind === "linear") return { axis: evenAxis(values, size), height: (value) => value };
  const height = (value: number) => toSignedLog(value * size);
  const [low, high] = [Math.min(...values) * size, Math.max(...values) * size];
  const decades = (reach: number) => {
    const count = Math.min(Math.max(Math.ceil(Math.log10(reach) - 1e-9), 0) + 1, 8);
    return reach > 0 ? Array.from({ length: count }, (_, power) => 10 ** power) : [];
  };
  const all = [...decades(-low).map((tick) => -tick).reverse(), 0, ...decades(high)];
  const ticks = all.map((tick) => ({ place: toSignedLog(tick), label: significant(tick) }));
  return { axis: { low: ticks[0]!.place, high: ticks.at(-1)!.place, ticks }, height };
}

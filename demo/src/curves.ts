/** Solver curves of published protocols, written by `python -m experiments.demo_curves`. */

import { QUANTITIES, sameProtocol, type Counts, type Protocol } from "./protocol";

export interface Curve {
  name: string;
  kind: "paper" | "test";
  protocol: Protocol;
  /** Of the solver's own history, which is finer than the measurement steps. */
  results: { pull_off_force: number; pull_off_time: number; hysteresis: number };
  /** On the measurement steps. */
  force: number[];
}

export interface CurveSet {
  counts: Counts;
  modulus_ratio: number;
  accuracy: string;
  curves: Curve[];
}

/**
 * Fetch the curves.
 *
 * @throws Error with one sentence for the reader.
 */
export async function loadCurves(url: string): Promise<CurveSet> {
  const response = await fetch(url);
  if (!response.ok) throw new Error(`The solver curves could not be loaded (${url} answers ${response.status}).`);
  return (await response.json()) as CurveSet;
}

/** The paper's number of a sample, or the place of a trajectory in the data set. */
export function number(curve: Curve): string {
  const digits = curve.name.slice(curve.name.lastIndexOf("-") + 1);
  return curve.kind === "paper" ? `(${digits})` : digits;
}

/** What a curve is called on the page. */
export function title(curve: Curve): string {
  return `${curve.kind === "paper" ? "Paper sample" : "Test trajectory"} ${number(curve)}`;
}

export function curveOf(curves: readonly Curve[], protocol: Protocol): Curve | undefined {
  return curves.find((curve) => sameProtocol(protocol, curve.protocol));
}

/** The curve whose protocol is nearest in the logarithms of the quantities. */
export function nearestCurve(curves: readonly Curve[], protocol: Protocol): Curve {
  const distance = (curve: Curve) =>
    QUANTITIES.reduce((sum, name) => sum + Math.log(protocol[name] / curve.protocol[name]) ** 2, 0);
  return curves.reduce((best, curve) => (distance(curve) < distance(best) ? curve : best));
}

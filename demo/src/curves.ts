/**
 * Solver curves of published protocols, written by `python -m experiments.demo_curves`: one file on the paper's
 * measurement steps and of its solid, one on steps around the pull-off and of any standard linear solid.
 */

import { fetchFile } from "./files";
import { complaint, QUANTITIES, sameProtocol, type Counts, type Protocol, type Quantity } from "./protocol";
import { Trouble } from "./trouble";

export interface Curve {
  name: string;
  kind: "paper" | "test" | "solid";
  protocol: Protocol;
  /** Of the solver's own history, which is finer than the measurement steps. */
  results: { pull_off_force: number; pull_off_time: number; hysteresis: number };
  /** On its measurement steps. */
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
 * @throws Trouble where they cannot be had or are no curves.
 */
export async function loadCurves(url: string): Promise<CurveSet> {
  const bytes = await fetchFile(url, "The solver curves");
  let content: unknown;
  try {
    content = JSON.parse(new TextDecoder().decode(bytes));
  } catch {
    content = undefined;
  }
  if (!isCurveSet(content)) {
    throw new Trouble(`The solver curves could not be read: ${url} is not what experiments.demo_curves writes.`);
  }
  for (const { protocol } of content.curves) protocol.modulus_ratio ??= content.modulus_ratio;
  return content;
}

function isCurveSet(content: unknown): content is CurveSet {
  const { counts, curves, modulus_ratio } = (content ?? {}) as Partial<CurveSet>;
  if (complaint(modulus_ratio ?? NaN, "modulus_ratio")) return false;
  if (!areNumbers(counts, 3) || !counts.every((count) => Number.isInteger(count) && count > 1)) return false;
  const steps = counts.reduce((sum, count) => sum + count);
  return Array.isArray(curves) && curves.length > 0 && curves.every((curve: unknown) => isCurve(curve, steps));
}

function isCurve(content: unknown, steps: number): content is Curve {
  const { name, kind, protocol, results, force } = (content ?? {}) as Partial<Curve>;
  // The paper's curves leave out the modulus ratio, which they share.
  const usable = (quantity: Quantity) =>
    (quantity === "modulus_ratio" && protocol?.[quantity] === undefined) ||
    complaint(protocol?.[quantity] ?? NaN, quantity) === undefined;
  return (
    typeof name === "string" &&
    (kind === "paper" || kind === "test" || kind === "solid") &&
    QUANTITIES.every(usable) &&
    areNumbers([results?.pull_off_force, results?.pull_off_time, results?.hysteresis], 3) &&
    areNumbers(force, steps)
  );
}

function areNumbers(values: unknown, length: number): values is number[] {
  return Array.isArray(values) && values.length === length && values.every(Number.isFinite);
}

/** The paper's number of a sample, or the place of a trajectory in the data set. */
export function number(curve: Curve): string {
  const digits = curve.name.slice(curve.name.lastIndexOf("-") + 1);
  return curve.kind === "test" ? digits : `(${digits})`;
}

/** What a curve is called on the page. */
export function title(curve: Curve): string {
  const kinds = { paper: "Paper sample", test: "Test trajectory", solid: "Solid" };
  return `${kinds[curve.kind]} ${number(curve)}`;
}

export function curveOf(curves: readonly Curve[], protocol: Protocol): Curve | undefined {
  return curves.find((curve) => sameProtocol(protocol, curve.protocol));
}

/** The curve whose protocol is nearest in the logarithms of the quantities, each scaled by its range among the curves. */
export function nearestCurve(curves: readonly Curve[], protocol: Protocol): Curve {
  const widths = QUANTITIES.map((name) => {
    const logarithms = curves.map((curve) => Math.log(curve.protocol[name]));
    return Math.max(...logarithms) - Math.min(...logarithms) || 1;
  });
  const distance = (curve: Curve) =>
    QUANTITIES.reduce((sum, name, i) => sum + (Math.log(protocol[name] / curve.protocol[name]) / widths[i]!) ** 2, 0);
  return curves.reduce((best, curve) => (distance(curve) < distance(best) ? curve : best));
}

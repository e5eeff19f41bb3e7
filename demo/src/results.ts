/** The numbers beside the charts: prediction, solver where there is a curve, the error between them, and the pinned one. */

import { title, type Curve } from "./curves";
import { percent, significant } from "./format";
import { atSteps, forceError, hysteresis, pullOff, relativeError } from "./measures";
import type { Prediction, Ranges } from "./model";
import { LABELS, QUANTITIES, type Grid, type Protocol, type Quantity } from "./protocol";
import { worded, type Units } from "./units";

const byId = (id: string) => document.getElementById(id)!;
const TILES = [
  ["pull-off-force", "force"],
  ["pull-off-time", "time"],
  ["hysteresis", "work"],
] as const;
type Numbers = readonly [number, number, number];

export interface Computed {
  curve: Curve;
  /** Its steps. */
  grid: Grid;
}

/** The solver's force at the steps of a prediction. */
export function forceOfSolver({ curve, grid }: Computed, prediction: Prediction): Float64Array {
  return atSteps(prediction.grid, grid, curve.force);
}

const ofPrediction = ({ pullOff: top, hysteresis: area }: Prediction): Numbers => [top.force, top.time, area];

/**
 * What the solver gives for a curve: on the steps of the paper's model, which knows no more than these, and in its own
 * time steps for `fast`, which interpolates.
 */
export function ofSolver({ curve, grid }: Computed, banded: boolean): Numbers {
  if (banded) return [curve.results.pull_off_force, curve.results.pull_off_time, curve.results.hysteresis];
  const top = pullOff(grid, curve.force);
  return [top.force, top.time, hysteresis(grid, curve.force)];
}

/** Show what is read off a prediction, or off the solver's curve where there is none; without both, no number. */
export function showResults(
  prediction: Prediction | undefined,
  computed: Computed | undefined,
  pinned: Prediction | undefined,
  units: Units,
  model: string,
): void {
  const ours = prediction && ofPrediction(prediction);
  const solver = computed && ofSolver(computed, !prediction || prediction.band !== undefined);
  const other = pinned && ofPrediction(pinned);
  TILES.forEach(([id, scale], i) => {
    const value = (ours ?? solver)?.[i];
    const say = (number: number) => {
      const [text, unit] = worded(number, units[scale], units.laboratory);
      return units.laboratory ? `${text}\u00a0${unit}` : text;
    };
    const [text, unit] = value === undefined ? ["–", ""] : worded(value, units[scale], units.laboratory);
    const output = byId(id);
    output.textContent = text;
    output.dataset["value"] = String(value ?? "");
    byId(`${id}-unit`).textContent = unit;
    const beside = [];
    if (value !== undefined && !ours) beside.push("computed by the solver");
    if (ours && solver) beside.push(`solver ${say(solver[i]!)} · error\u00a0${percent(relativeError(ours[i]!, solver[i]!))}`);
    if (ours && !solver) beside.push(`predicted by ${model}`);
    if (ours && other) beside.push(`pinned ${say(other[i]!)}`);
    byId(`${id}-beside`).textContent = beside.join("; ");
  });
  showInterval(prediction?.band?.pullOff, units);
}

function showInterval(interval: readonly [number, number] | undefined, units: Units): void {
  const line = byId("pull-off-interval");
  line.hidden = !interval;
  line.dataset["ends"] = interval ? interval.join() : "";
  if (!interval) return;
  const words = interval.map((value) => worded(value, units.force, units.laboratory));
  const shown = units.laboratory ? words.map((each) => each.join("\u00a0")) : words.map(([text]) => text);
  line.textContent = `90 %: ${shown.join(" to ")}`;
}

/** Say how far a prediction is from the solver's curve, or name the nearest computed protocol. */
export function showComparison(
  prediction: Prediction | undefined,
  computed: Computed | undefined,
  nearest: Curve,
  choose: (curve: Curve) => void,
): void {
  const line = byId("comparison");
  delete line.dataset["error"];
  if (!computed) {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = title(nearest);
    button.addEventListener("click", () => choose(nearest));
    line.replaceChildren("A protocol of your own: the solver has not computed it. The nearest computed one: ", button);
    return;
  }
  const { curve } = computed;
  if (!prediction) {
    line.textContent = `${title(curve)}, computed by the solver.`;
    return;
  }
  const force = forceOfSolver(computed, prediction);
  const error = forceError(prediction.force, force);
  line.dataset["error"] = String(error);
  const words = [`${title(curve)}: force error ${percent(error)}.`];
  const own = curve.results.pull_off_force;
  if (prediction.band) {
    const { lower, upper, pullOff: ends } = prediction.band;
    const inside = force.filter((value, step) => lower[step]! <= value && value <= upper[step]!).length;
    const word = ends[0] <= own && own <= ends[1] ? "inside" : "outside";
    words.push(
      `The solver’s pull-off force ${significant(own)} lies ${word} the 90 % interval, and its force inside the band at ` +
        `${inside} of ${force.length} steps.`,
    );
  } else {
    const floor = relativeError(pullOff(computed.grid, curve.force).force, own);
    words.push(
      `In its own, finer time steps the solver peaks at ${significant(own)}, ${percent(floor)} away from the largest ` +
        "force on the measurement steps.",
    );
  }
  line.textContent = words.join(" ");
}

/**
 * Say that there is no prediction, and why.
 *
 * @param unlike Whether the training covers each quantity, but not their combination.
 */
export function showOutside(outside: readonly Quantity[], ranges: Ranges, name: string, unlike: boolean): void {
  const banner = byId("outside");
  banner.hidden = outside.length === 0 && !unlike;
  const words = outside.map((quantity) => {
    const [low, high] = ranges[quantity].map((value) => significant(value, 3));
    return `${LABELS[quantity].name} (${low} to ${high})`;
  });
  banner.textContent = unlike
    ? `No prediction: the training of ${name} covers each of these quantities, but not all of them together.`
    : `No prediction: outside the training range of ${name} in ${words.join(", ")}.`;
}

/** A protocol in a few words. */
export function brief(protocol: Protocol): string {
  return QUANTITIES.map((name) => `${LABELS[name].brief}\u00a0${significant(protocol[name], 3)}`).join(" · ");
}

/** List all solver curves with their errors; a click on one shows it. */
export function listCurves(
  rows: readonly { curve: Curve; error: number; pullOffError: number }[],
  choose: (curve: Curve) => void,
): void {
  byId("curve-list").replaceChildren(
    ...rows.map(({ curve, error, pullOffError }) => {
      const row = document.createElement("tr");
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = title(curve);
      button.addEventListener("click", () => choose(curve));
      const values = QUANTITIES.map((name) => significant(curve.protocol[name], 3));
      for (const content of [button, ...values, percent(error), percent(pullOffError)]) row.insertCell().append(content);
      Object.assign(row.dataset, { name: curve.name, error, pullOffError });
      return row;
    }),
  );
}

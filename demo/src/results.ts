/** The numbers beside the charts: surrogate, solver where there is a curve, and the error between them. */

import type { Curve } from "./curves";
import { title } from "./curves";
import { milliseconds, percent, significant } from "./format";
import { forceError, hysteresis, pullOff, relativeError } from "./measures";
import type { Prediction } from "./model";
import { LABELS, QUANTITIES, type Grid, type Quantity } from "./protocol";
import { worded, type Units } from "./units";

const byId = (id: string) => document.getElementById(id)!;

function tile(
  id: string,
  value: number,
  units: Units,
  scale: "force" | "time" | "work",
  reference?: number,
  caveat = "",
): void {
  const output = byId(id);
  const [text, unit] = worded(value, units[scale], units.laboratory);
  output.textContent = text;
  output.dataset["value"] = String(value);
  byId(`${id}-unit`).textContent = unit;
  const other = reference === undefined ? [] : worded(reference, units[scale], units.laboratory);
  byId(`${id}-solver`).textContent =
    reference === undefined
      ? caveat
      : `solver ${units.laboratory ? other.join("\u00a0") : other[0]} · error\u00a0${percent(relativeError(value, reference))}${caveat && `; ${caveat}`}`;
}

/**
 * What the solver gives for a curve: on the steps of the paper's models, which know no more than these, and in its own
 * time steps for a pretrained model, which interpolates.
 */
export function solverResults(grid: Grid, curve: Curve, banded: boolean): Curve["results"] {
  if (banded) return curve.results;
  const top = pullOff(grid, curve.force);
  return { pull_off_force: top.force, pull_off_time: top.time, hysteresis: hysteresis(grid, curve.force) };
}

/** Show what is read off a prediction. */
export function showResults(prediction: Prediction, curve: Curve | undefined, units: Units): void {
  const { grid, band } = prediction;
  const reference = curve && solverResults(grid, curve, band !== undefined);
  tile("pull-off-force", prediction.pullOff.force, units, "force", reference?.pull_off_force);
  // On equal steps an instant is known to a measurement step.
  const step = grid.times[grid.ends[2]]! - grid.times[grid.ends[2] - 1]!;
  const caveat = band ? "" : `to ± ${worded(step, units.time, units.laboratory).join("\u00a0")}, one step`;
  tile("pull-off-time", prediction.pullOff.time, units, "time", reference?.pull_off_time, caveat);
  tile("hysteresis", prediction.hysteresis, units, "work", reference?.hysteresis);
  showInterval(band?.pullOff, units);
}

function showInterval(interval: readonly [number, number] | undefined, units: Units): void {
  const line = byId("pull-off-interval");
  line.hidden = !interval;
  if (!interval) {
    delete line.dataset["low"];
    delete line.dataset["high"];
    return;
  }
  const [low, high] = interval;
  line.dataset["low"] = String(low);
  line.dataset["high"] = String(high);
  const words = interval.map((value) => worded(value, units.force, units.laboratory));
  const shown = units.laboratory ? words.map((each) => each.join("\u00a0")) : words.map(([text]) => text);
  line.textContent = Number.isFinite(low) ? `90 %: ${shown.join(" to ")}` : "90 %: unbounded, outside the training";
}

/** Show the median time of recent predictions. */
export function showInference(median: number): void {
  byId("inference").textContent = milliseconds(median);
  byId("inference").dataset["value"] = String(median);
}

/** Say which solver curve is drawn and how far it is, or which is the nearest. */
export function showComparison(
  { grid, force, band }: Prediction,
  curve: Curve | undefined,
  nearest: Curve,
  choose: (curve: Curve) => void,
): void {
  const line = byId("comparison");
  if (!curve) {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = title(nearest);
    button.addEventListener("click", () => choose(nearest));
    const what = band ? "protocol and solid" : "protocol";
    line.replaceChildren(`No solver curve was published for this very ${what}. The nearest one: `, button);
    delete line.dataset["error"];
    return;
  }
  const error = forceError(force, curve.force);
  line.dataset["error"] = String(error);
  const own = curve.results.pull_off_force;
  const start = `${title(curve)}: force error ${percent(error)}.`;
  if (!band) {
    const floor = relativeError(pullOff(grid, curve.force).force, own);
    line.textContent =
      `${start} In its own, finer time steps the solver peaks at ` +
      `${significant(own)}, ${percent(floor)} away from the largest force on the measurement steps.`;
    return;
  }
  const inside = band.pullOff[0] <= own && own <= band.pullOff[1] ? "inside" : "outside";
  const steps = curve.force.length;
  line.textContent = Number.isFinite(band.pullOff[0])
    ? `${start} The solver’s pull-off force ${significant(own)} lies ${inside} the 90 % interval, and its force inside ` +
      `the band at ${stepsInside(band, curve.force)} of ${steps} steps.`
    : start;
}

function stepsInside({ lower, upper }: NonNullable<Prediction["band"]>, force: readonly number[]): number {
  return force.filter((value, step) => lower[step]! <= value && value <= upper[step]!).length;
}

/** Say that a prediction is an extrapolation, and in what. */
export function showExtrapolation(outside: readonly Quantity[], banded: boolean): void {
  const banner = byId("extrapolation");
  banner.hidden = outside.length === 0;
  const names = outside.map((name) => LABELS[name].name);
  const end = banded ? "; there its 90 % band and interval are unbounded." : ".";
  banner.textContent = `Extrapolation, the surrogate may be far off: outside its training range in ${names.join(", ")}${end}`;
}

/** List all solver curves with their errors; a click on one shows it. */
export function listCurves(
  rows: readonly { curve: Curve; error: number; pullOffError: number }[],
  choose: (curve: Curve) => void,
): void {
  const body = byId("curve-list");
  body.replaceChildren(
    ...rows.map(({ curve, error, pullOffError }) => {
      const row = document.createElement("tr");
      const values = QUANTITIES.map((name) => significant(curve.protocol[name], 3));
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = title(curve);
      button.addEventListener("click", () => choose(curve));
      const cells = [button, ...values, percent(error), percent(pullOffError)].map((content) => {
        const cell = document.createElement("td");
        cell.append(content);
        return cell;
      });
      row.append(...cells);
      row.dataset["name"] = curve.name;
      row.dataset["error"] = String(error);
      row.dataset["pullOffError"] = String(pullOffError);
      return row;
    }),
  );
}

/** The numbers beside the charts: surrogate, solver where there is a curve, and the error between them. */

import type { Curve } from "./curves";
import { title } from "./curves";
import { milliseconds, percent, significant } from "./format";
import { forceError, hysteresis, pullOff, relativeError } from "./measures";
import { LABELS, type Grid, type Quantity } from "./protocol";
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

/** Show what is read off a prediction. */
export function showResults(grid: Grid, force: Float64Array, curve: Curve | undefined, units: Units): void {
  const top = pullOff(grid, force);
  const reference = curve && pullOff(grid, curve.force);
  tile("pull-off-force", top.force, units, "force", reference?.force);
  // An instant is known to a measurement step.
  const step = grid.times[grid.ends[2]]! - grid.times[grid.ends[2] - 1]!;
  const caveat = `to ± ${worded(step, units.time, units.laboratory).join("\u00a0")}, one step`;
  tile("pull-off-time", top.time, units, "time", reference?.time, caveat);
  tile("hysteresis", hysteresis(grid, force), units, "work", curve && hysteresis(grid, curve.force));
}

/** Show the median time of recent predictions. */
export function showInference(median: number): void {
  byId("inference").textContent = milliseconds(median);
  byId("inference").dataset["value"] = String(median);
}

/** Say which solver curve is drawn and how far it is, or which is the nearest. */
export function showComparison(
  grid: Grid,
  force: Float64Array,
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
    line.replaceChildren("No solver curve was published for this very protocol. The nearest one: ", button);
    delete line.dataset["error"];
    return;
  }
  const error = forceError(force, curve.force);
  const onSteps = pullOff(grid, curve.force).force;
  const floor = relativeError(onSteps, curve.results.pull_off_force);
  line.dataset["error"] = String(error);
  line.textContent =
    `${title(curve)}: force error ${percent(error)}. In its own, finer time steps the solver peaks at ` +
    `${significant(curve.results.pull_off_force)}, ${percent(floor)} away from the largest force on the measurement steps.`;
}

/** Say that a prediction is an extrapolation, and in what. */
export function showExtrapolation(outside: readonly Quantity[]): void {
  const banner = byId("extrapolation");
  banner.hidden = outside.length === 0;
  const names = outside.map((name) => LABELS[name].name);
  banner.textContent = `Extrapolation, the surrogate may be far off: outside its training range in ${names.join(", ")}.`;
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
      const { tabor, peak_indentation, loading_rate, dwell_time, unloading_rate } = curve.protocol;
      const values = [tabor, peak_indentation, loading_rate, dwell_time, unloading_rate].map((value) =>
        significant(value, 3),
      );
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
      return row;
    }),
  );
}

/** The history on the screen as CSV, the charts as PNG. */

import { protocolFragment } from "./address";
import type { Prediction } from "./model";
import type { Protocol } from "./protocol";
import type { Units } from "./units";

/**
 * One row for each measurement step; numbers in full precision. `fast` adds the modulus ratio and its band; laboratory units add columns in SI units.
 */
export function csv(
  protocol: Protocol,
  { grid, force, band }: Prediction,
  units: Units,
  solver?: ArrayLike<number>,
): string {
  const [onset, end] = grid.ends;
  const phase = (i: number) => (i <= onset ? "loading" : i <= end ? "dwell" : "unloading");
  const { length, time: instant, force: strength, laboratory } = units;
  const banded = band ? ["modulus_ratio", "force_lower", "force_upper"] : [];
  const header = ["time", "indentation", "tabor", "edge", "phase", "force", ...banded];
  if (solver) header.push("solver_force");
  if (laboratory) header.push("time_s", "indentation_m", "force_N");
  const si = (i: number) =>
    laboratory
      ? [grid.times[i]! * instant.size, grid.indentations[i]! * length.size, force[i]! * strength.size]
      : [];
  const rows = [...grid.times].map((time, i) =>
    [
      ...[time, grid.indentations[i], protocol.tabor, grid.edge[i], phase(i), force[i]],
      ...(band ? [protocol.modulus_ratio, band.lower[i], band.upper[i]] : []),
      ...(solver ? [solver[i]] : []),
      ...si(i),
    ].join(","),
  );
  return [header.join(","), ...rows, ""].join("\n");
}

export function downloadCsv(text: string, name: string): void {
  const url = URL.createObjectURL(new Blob([text], { type: "text/csv" }));
  download(url, `${name}.csv`);
  setTimeout(() => URL.revokeObjectURL(url), 60_000);
}

export function downloadPng(url: string, name: string): void {
  download(url, `${name}.png`);
}

/** The name of a downloaded file, without its suffix. */
export function fileName(protocol: Protocol, model: string): string {
  return `contact_${protocolFragment(protocol).replaceAll("=", "-").replaceAll("&", "_")}_${model}`;
}

function download(url: string, name: string): void {
  const link = document.createElement("a");
  link.href = url;
  link.download = name;
  link.click();
}

/** The history on the screen as CSV, the charts as PNG. */

import { protocolFragment } from "./address";
import type { Grid, Protocol } from "./protocol";
import type { Units } from "./units";

/** One row for each measurement step; numbers in full precision. Laboratory units add columns in SI units. */
export function csv(
  protocol: Protocol,
  grid: Grid,
  force: Float64Array,
  units: Units,
  solver?: readonly number[],
): string {
  const [onset, end] = grid.ends;
  const phase = (i: number) => (i <= onset ? "loading" : i <= end ? "dwell" : "unloading");
  const { length, time: instant, force: strength, laboratory } = units;
  const header = ["time", "indentation", "tabor", "edge", "phase", "force", ...(solver ? ["solver_force"] : [])];
  if (laboratory) header.push("time_s", "indentation_m", "force_N");
  const si = (i: number) =>
    laboratory
      ? [grid.times[i]! * instant.size, grid.indentations[i]! * length.size, force[i]! * strength.size]
      : [];
  const rows = [...grid.times].map((time, i) =>
    [
      ...[time, grid.indentations[i], protocol.tabor, grid.edge[i], phase(i), force[i]],
      ...(solver ? [solver[i]] : []),
      ...si(i),
    ].join(","),
  );
  return [header.join(","), ...rows, ""].join("\n");
}

export function downloadCsv(text: string, protocol: Protocol): void {
  const url = URL.createObjectURL(new Blob([text], { type: "text/csv" }));
  download(url, `${fileName(protocol)}.csv`);
  setTimeout(() => URL.revokeObjectURL(url), 60_000);
}

export function downloadPng(url: string, protocol: Protocol): void {
  download(url, `${fileName(protocol)}.png`);
}

function fileName(protocol: Protocol): string {
  return `contact_${protocolFragment(protocol).replaceAll("=", "-").replaceAll("&", "_")}`;
}

function download(url: string, name: string): void {
  const link = document.createElement("a");
  link.href = url;
  link.download = name;
  link.click();
}

/** The history on the screen as CSV, the charts as PNG. */

import { protocolFragment } from "./address";
import type { Grid, Protocol } from "./protocol";

/** One row for each measurement step; numbers in full precision. */
export function csv(protocol: Protocol, grid: Grid, force: Float64Array, solver?: readonly number[]): string {
  const [onset, end] = grid.ends;
  const phase = (i: number) => (i <= onset ? "loading" : i <= end ? "dwell" : "unloading");
  const header = ["time", "indentation", "tabor", "edge", "phase", "force", ...(solver ? ["solver_force"] : [])];
  const rows = [...grid.times].map((time, i) =>
    [time, grid.indentations[i], protocol.tabor, grid.edge[i], phase(i), force[i], ...(solver ? [solver[i]] : [])].join(
      ",",
    ),
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

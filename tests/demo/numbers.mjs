/**
 * The page's own arithmetic without a browser: reads cases as JSON from standard input and writes steps, results and
 * half-widths of bands as JSON, for `check_numbers.py`.
 */

import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const demo = join(dirname(fileURLToPath(import.meta.url)), "../../demo");
const { build } = createRequire(join(demo, "package.json"))("esbuild");
const parts = ["physical_steps", "protocol", "measures", "bands"];
const contents = parts.map((part) => `export * from "./${part}";`).join("\n");
const { outputFiles } = await build({
  stdin: { contents, resolveDir: join(demo, "src"), loader: "ts" },
  bundle: true,
  format: "esm",
  write: false,
});
const page = await import(`data:text/javascript;base64,${Buffer.from(outputFiles[0].contents).toString("base64")}`);

const { protocols, forces, counts, bands, coverage } = JSON.parse(readFileSync(0, "utf8"));
const steps = counts.reduce((sum, count) => sum + count);
const read = page.parseBands(JSON.stringify(bands), steps);
const found = protocols.map((protocol, row) => {
  const grid = page.physicalGrid(protocol, counts);
  const top = page.smoothPullOff(grid, forces[row]);
  const hysteresis = page.smoothHysteresis(grid, forces[row]);
  const widths = page.halfWidths(read, protocol, top.sharpness, coverage);
  return { times: [...grid.times], indentations: [...grid.indentations], edge: [...grid.edge], top, hysteresis, widths };
});
const damaged = { ...bands, shape: bands.shape.slice(1) };
console.log(JSON.stringify({ found, damaged: page.parseBands(JSON.stringify(damaged), steps) ?? null }));

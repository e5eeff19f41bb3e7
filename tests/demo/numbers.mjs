/** The page's own arithmetic without a browser: reads protocols as JSON and writes steps and predictions, for `check_numbers.py`. */

import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const demo = join(dirname(fileURLToPath(import.meta.url)), "../../demo");
const { build } = createRequire(join(demo, "package.json"))("esbuild");
const modules = ["pull_off_steps", "solid_features", "fast", "axes", "measures"];
const { outputFiles } = await build({
  stdin: { contents: modules.map((name) => `export * from "./${name}";`).join("\n"), resolveDir: join(demo, "src"), loader: "ts" },
  bundle: true,
  format: "esm",
  write: false,
});
const page = await import(`data:text/javascript;base64,${Buffer.from(outputFiles[0].contents).toString("base64")}`);

const { protocols, counts, pullOffTimes } = JSON.parse(readFileSync(0, "utf8"));
const fast = page.Fast.read(Uint8Array.from(readFileSync(join(demo, "public/fast.bin"))));
// Of the processor, on which others may work, too.
const began = process.cpuUsage();
const predictions = protocols.map((protocol) => fast.evaluate(protocol) ?? null);
const milliseconds = process.cpuUsage(began).user / 1e3 / protocols.length;
const rows = protocols.map((protocol, i) => {
  const steps = page.pullOffGrid(protocol, counts, pullOffTimes[i]);
  const [scale, real] = ["phases", "real"].map((kind) => new page.TimeScale(protocol, kind));
  const places = steps.times.map((time) => scale.place(time));
  const back = places.map((place) => scale.instant(place));
  const axis = { corners: scale.corners, ends: scale.places, places, back, real: steps.times.map((time) => real.place(time)) };
  const other = page.pullOffGrid(protocol, counts, 0.999 * pullOffTimes[i]);
  const interpolated = page.atSteps(other, steps, [...steps.indentations].map(Math.sin));
  return { steps, axis, features: page.solidFeatures(protocol), other, interpolated, prediction: predictions[i] };
});
console.log(JSON.stringify({ rows, milliseconds }, (_, value) => (value instanceof Float64Array ? [...value] : value)));

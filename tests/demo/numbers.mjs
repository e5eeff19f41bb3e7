/** The page's own arithmetic without a browser: reads protocols as JSON and writes steps and predictions, for `check_numbers.py`. */

import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const demo = join(dirname(fileURLToPath(import.meta.url)), "../../demo");
const { build } = createRequire(join(demo, "package.json"))("esbuild");
const contents = 'export * from "./physical_steps"; export { Fast } from "./fast"; export { TimeScale } from "./axes";';
const { outputFiles } = await build({
  stdin: { contents, resolveDir: join(demo, "src"), loader: "ts" },
  bundle: true,
  format: "esm",
  write: false,
});
const page = await import(`data:text/javascript;base64,${Buffer.from(outputFiles[0].contents).toString("base64")}`);

const { protocols, counts } = JSON.parse(readFileSync(0, "utf8"));
const fast = page.Fast.read(Uint8Array.from(readFileSync(join(demo, "public/fast.bin"))));
const rows = protocols.map((protocol) => {
  const { times, indentations, edge } = page.physicalGrid(protocol, counts);
  const { force, pullOff, hysteresis, band } = fast.evaluate(protocol);
  const { lower, upper, pullOff: interval } = band;
  const [scale, real] = ["phases", "real"].map((kind) => new page.TimeScale(protocol, kind));
  const places = times.map((time) => scale.place(time));
  const back = places.map((place) => scale.instant(place));
  const axis = { corners: scale.corners, ends: scale.places, places, back, real: times.map((time) => real.place(time)) };
  return { times, indentations, edge, force, pullOff, hysteresis, lower, upper, interval, axis };
});
console.log(JSON.stringify(rows, (_, value) => (value instanceof Float64Array ? [...value] : value)));

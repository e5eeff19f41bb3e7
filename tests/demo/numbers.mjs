/** The page's own arithmetic without a browser: reads protocols as JSON and writes their steps, for `check_numbers.py`. */

import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const demo = join(dirname(fileURLToPath(import.meta.url)), "../../demo");
const { build } = createRequire(join(demo, "package.json"))("esbuild");
const contents = 'export * from "./physical_steps";';
const { outputFiles } = await build({
  stdin: { contents, resolveDir: join(demo, "src"), loader: "ts" },
  bundle: true,
  format: "esm",
  write: false,
});
const page = await import(`data:text/javascript;base64,${Buffer.from(outputFiles[0].contents).toString("base64")}`);

const { protocols, counts } = JSON.parse(readFileSync(0, "utf8"));
const grids = protocols.map((protocol) => page.physicalGrid(protocol, counts));
const arrays = ["times", "indentations", "edge"];
console.log(JSON.stringify(grids.map((grid) => Object.fromEntries(arrays.map((name) => [name, [...grid[name]]])))));

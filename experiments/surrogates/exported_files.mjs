/**
 * Time exported files in headless Chromium, by ONNX Runtime Web on one thread of WebAssembly, as the demonstrator does.
 *
 * Usage: node exported_files.mjs CHROMIUM < QUESTION. The question is JSON: `rounds`, and for each file its `path` and
 * the `inputs` of several protocols, by name the values and the dimensions of one. The answer is JSON: for each file the
 * milliseconds of a protocol in each round, and the forces of the first round.
 */

import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";
import { fileURLToPath } from "node:url";

const demo = fileURLToPath(new URL("../../demo/", import.meta.url));
const { chromium } = createRequire(join(demo, "package.json"))("playwright-core");
const runtime = (name) => readFileSync(join(demo, "node_modules/onnxruntime-web/dist", name));
const { rounds, files } = JSON.parse(readFileSync(0, "utf8"));

/** What the page does with one file. */
async function time({ model, inputs, rounds }) {
  const ort = await import("/ort.wasm.bundle.min.mjs");
  ort.env.wasm.numThreads = 1;
  const bytes = await (await fetch(model)).arrayBuffer();
  const session = await ort.InferenceSession.create(bytes, { executionProviders: ["wasm"] });
  const tensor = ([name, { values, dims }]) => [name, new ort.Tensor("float64", Float64Array.from(values), dims)];
  const protocols = inputs.map((one) => Object.fromEntries(Object.entries(one).map(tensor)));
  const forces = [];
  for (const one of protocols) forces.push([...(await session.run(one)).force.data]);
  const milliseconds = [];
  for (let round = 0; round < rounds; round++) {
    const begin = performance.now();
    for (const one of protocols) await session.run(one);
    milliseconds.push((performance.now() - begin) / protocols.length);
  }
  return { milliseconds, forces };
}

const browser = await chromium.launch({ executablePath: process.argv[2], args: ["--no-sandbox", "--disable-gpu"] });
const page = await browser.newPage();
const types = { mjs: "text/javascript", wasm: "application/wasm" };
await page.route("http://page/**", (route) => {
  const name = new URL(route.request().url()).pathname.slice(1);
  if (!name) return route.fulfill({ contentType: "text/html", body: "" });
  const body = /^\d+$/.test(name) ? readFileSync(files[Number(name)].path) : runtime(name);
  return route.fulfill({ contentType: types[name.split(".").pop()] ?? "application/octet-stream", body });
});
await page.goto("http://page/");
const answers = [];
for (const [index, { inputs }] of files.entries()) {
  answers.push(await page.evaluate(time, { model: `/${index}`, inputs, rounds }));
}
const version = browser.version();
await browser.close();
console.log(JSON.stringify({ version, answers }));

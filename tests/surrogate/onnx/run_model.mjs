/**
 * Run a file of `surrogate export` from JavaScript, as a page does: node run_model.mjs MODEL BATCH STEPS NAME...
 *
 * Standard input: times, indentations and edge of BATCH x STEPS numbers, tabor and modulus_ratio of BATCH numbers, all
 * float64. Standard output: the outputs NAME, one after the other, likewise.
 */

import { readFileSync, writeSync } from "node:fs";

const ort = await import(new URL("../../../demo/node_modules/onnxruntime-web/dist/ort.wasm.bundle.min.mjs", import.meta.url));
ort.env.wasm.numThreads = 1;

const [model, batch, steps, ...names] = process.argv.slice(2).map((word) => (isNaN(word) ? word : Number(word)));
const given = readFileSync(0);
const numbers = new Float64Array(given.buffer.slice(given.byteOffset, given.byteOffset + given.length));
const feeds = {};
let read = 0;
for (const [name, ...rest] of [["times", steps], ["indentations", steps], ["edge", steps], ["tabor"], ["modulus_ratio"]]) {
  const dims = [batch, ...rest];
  const size = dims.reduce((product, one) => product * one);
  feeds[name] = new ort.Tensor("float64", numbers.slice(read, (read += size)), dims);
}
const session = await ort.InferenceSession.create(readFileSync(model));
const found = await session.run(feeds);
for (const name of names) {
  const { data } = found[name];
  writeSync(1, Buffer.from(data.buffer, data.byteOffset, data.byteLength));
}

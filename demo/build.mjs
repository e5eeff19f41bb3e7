/**
 * Build the demonstrator into dist/: bundle the page, copy models, solver curves and the WebAssembly of ONNX Runtime, split
 * the contacts into a file each, and list all for the service worker. Everything is addressed relatively, so dist/ works
 * at any path; only the picture of a link in other pages needs the page's address, DEMO_URL.
 *
 * Usage: node build.mjs [MODEL.onnx]
 */

import { createHash } from "node:crypto";
import { cpSync, existsSync, mkdirSync, readdirSync, readFileSync, rmSync, statSync, writeFileSync } from "node:fs";
import { basename, dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

import { build } from "esbuild";

const here = dirname(fileURLToPath(import.meta.url));
const published = "published/models/M1-concat/model.onnx";
const model = process.argv[2] || join(here, "..", published);
const dist = join(here, "dist");

if (!existsSync(model)) {
  const name = process.argv[2] || published;
  console.error(`${name} is missing; export it with \`surrogate export M1-concat --format onnx\`, then build again.`);
  process.exit(1);
}

rmSync(dist, { recursive: true, force: true });
mkdirSync(dist);
const fast = readFileSync(join(here, "public/fast.bin"));
const { ranges } = JSON.parse(fast.subarray(0, fast.indexOf(10)).toString());
const { metafile } = await build({
  entryPoints: [join(here, "src/main.ts")],
  outdir: dist,
  bundle: true,
  // ONNX Runtime becomes a file of its own, fetched with the paper's model.
  splitting: true,
  metafile: true,
  define: { FAST_RANGES: JSON.stringify(ranges) },
  format: "esm",
  target: "es2022",
  minify: true,
  legalComments: "none",
  logLevel: "warning",
});
for (const file of ["boot.js", "styles.css", "icon.svg"]) cpSync(join(here, "src", file), join(dist, file));
cpSync(join(here, "../docs/images/quantities.svg"), join(dist, "quantities.svg"));
for (const file of ["fast.bin", "curves.json", "solids.json", "card.png"]) {
  if (existsSync(join(here, "public", file))) cpSync(join(here, "public", file), join(dist, file));
}
const { nodes, contacts } = JSON.parse(readFileSync(join(here, "public/contacts.json"), "utf8"));
for (const contact of contacts) writeFileSync(join(dist, `contact-${contact.name}.json`), JSON.stringify({ nodes, ...contact }));
cpSync(model, join(dist, "model.onnx"));
cpSync(join(here, "node_modules/onnxruntime-web/dist/ort-wasm-simd-threaded.wasm"), join(dist, "ort.wasm"));

// ONNX Runtime's packages carry no licence, only a line in their sources.
const notice = "onnxruntime-web\n\nCopyright (c) Microsoft Corporation. Licensed under the MIT License.\n";
writeFileSync(join(dist, "licenses.txt"), notice);

const megabytes = readdirSync(dist).reduce((sum, file) => sum + statSync(join(dist, file)).size, 0) / 1e6;
const page = readFileSync(join(here, "src/index.html"), "utf8");
writeFileSync(join(dist, "index.html"), page.replace("BASE./", process.env.DEMO_URL ?? "./"));

const files = readdirSync(dist).sort();
const digest = createHash("sha256");
for (const file of files) digest.update(file).update(readFileSync(join(dist, file)));
const version = digest.digest("hex").slice(0, 16);
const { imports } = Object.entries(metafile.outputs).find(([file]) => basename(file) === "main.js")[1];
const chunks = imports.filter(({ kind }) => kind === "dynamic-import").map(({ path }) => basename(path));
const later = ["model.onnx", "ort.wasm", "curves.json", ...chunks];
const kept = ["./", ...files.filter((file) => !later.includes(file)).map((file) => `./${file}`)];
const lists = `const FILES = ${JSON.stringify(kept)};\nconst LATER = ${JSON.stringify(later)};\n`;
const constants = `const VERSION = ${JSON.stringify(version)};\n${lists}`;
writeFileSync(join(dist, "service-worker.js"), constants + readFileSync(join(here, "src/service_worker.js"), "utf8"));
console.log(`demo/dist: ${files.length + 1} files, ${megabytes.toFixed(1)} MB`);

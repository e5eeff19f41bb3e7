/**
 * Build the demonstrator into dist/: bundle the page, copy the ONNX file, the solver curves and the WebAssembly of ONNX
 * Runtime, and list all of them for the service worker. Everything is addressed relatively, so dist/ works at any path.
 *
 * Usage: node build.mjs [MODEL.onnx]
 */

import { createHash } from "node:crypto";
import { cpSync, existsSync, mkdirSync, readdirSync, readFileSync, rmSync, statSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
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
await build({
  entryPoints: [join(here, "src/main.ts")],
  outfile: join(dist, "main.js"),
  bundle: true,
  format: "esm",
  target: "es2022",
  minify: true,
  legalComments: "none",
  logLevel: "warning",
});
for (const file of ["boot.js", "styles.css", "icon.svg"]) cpSync(join(here, "src", file), join(dist, file));
cpSync(join(here, "../docs/images/quantities.svg"), join(dist, "quantities.svg"));
for (const file of readdirSync(join(here, "public"))) cpSync(join(here, "public", file), join(dist, file));
cpSync(model, join(dist, "model.onnx"));
cpSync(join(here, "node_modules/onnxruntime-web/dist/ort-wasm-simd-threaded.wasm"), join(dist, "ort.wasm"));

// The licences of what is bundled; ONNX Runtime's packages carry none, only a line in their sources.
const notices = ["echarts/LICENSE", "echarts/NOTICE", "zrender/LICENSE", "tslib/LICENSE.txt"].map(
  (file) => `${file}\n\n${readFileSync(join(here, "node_modules", file), "utf8")}`,
);
notices.push("onnxruntime-web\n\nCopyright (c) Microsoft Corporation. Licensed under the MIT License.\n");
writeFileSync(join(dist, "licenses.txt"), notices.join(`\n${"-".repeat(80)}\n`));

const megabytes = readdirSync(dist).reduce((sum, file) => sum + statSync(join(dist, file)).size, 0) / 1e6;
const page = readFileSync(join(here, "src/index.html"), "utf8");
writeFileSync(join(dist, "index.html"), page.replace("MEGABYTES", megabytes.toFixed(0)));

const files = readdirSync(dist).sort();
const digest = createHash("sha256");
for (const file of files) digest.update(file).update(readFileSync(join(dist, file)));
const version = digest.digest("hex").slice(0, 16);
const kept = JSON.stringify(["./", ...files.map((file) => `./${file}`)]);
const constants = `const VERSION = ${JSON.stringify(version)};\nconst FILES = ${kept};\n`;
writeFileSync(join(dist, "service-worker.js"), constants + readFileSync(join(here, "src/service_worker.js"), "utf8"));
console.log(`demo/dist: ${files.length + 1} files, ${megabytes.toFixed(1)} MB`);

/**
 * Open pages of the built site in headless Chromium, light and dark, and print the serious findings of axe-core as JSON, by page and scheme.
 *
 * Usage: node site.mjs CHROMIUM FILE...
 */

import { createRequire } from "node:module";
import { dirname, join } from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";

import { findings } from "./findings.mjs";

const here = dirname(fileURLToPath(import.meta.url));
const { chromium } = createRequire(join(here, "../../demo/package.json"))("playwright-core");
const [executablePath, ...files] = process.argv.slice(2);

const browser = await chromium.launch({ executablePath, args: ["--no-sandbox", "--disable-gpu"] });
const seen = {};
for (const file of files) {
  seen[file] = {};
  for (const colorScheme of ["light", "dark"]) {
    const page = await browser.newPage({ colorScheme, reducedMotion: "reduce" });
    await page.goto(pathToFileURL(file).href);
    const scheme = await page.evaluate(() => document.body.dataset.mdColorScheme);
    seen[file][scheme] = await findings(page);
    await page.close();
  }
}
await browser.close();
console.log(JSON.stringify(seen));

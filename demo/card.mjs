/**
 * The picture that other pages show beside a link to this one, `public/card.png`: the top of the built page.
 *
 * Usage: node card.mjs CHROMIUM
 */

import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

import { chromium } from "playwright-core";

const here = dirname(fileURLToPath(import.meta.url));
const browser = await chromium.launch({ executablePath: process.argv[2], args: ["--no-sandbox", "--disable-gpu"] });
const options = { viewport: { width: 1200, height: 630 }, reducedMotion: "reduce", serviceWorkers: "block" };
const page = await (await browser.newContext(options)).newPage();
await page.route("http://demo/**", (route) => {
  const { pathname } = new URL(route.request().url());
  return route.fulfill({ path: join(here, "dist", pathname === "/" ? "index.html" : pathname) });
});
await page.goto("http://demo/");
await page.waitForSelector("body[data-state=ready]");
await page.waitForSelector("#film[data-shown]");
await page.screenshot({ path: join(here, "public/card.png") });
await browser.close();

/**
 * Use the built demonstrator as a person would, in headless Chromium, and write down what was seen.
 *
 * Nothing is judged here: the numbers, messages and screenshots go to a folder, and `check_in_browser.py` compares them.
 *
 * Usage: node drive.mjs DIST FOLDER CHROMIUM PYTHON
 */

import { readFileSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

import { film } from "./film.mjs";
import { hidden, read, settled, visible } from "./looking.mjs";
import { serve } from "./serving.mjs";
import { solids } from "./solids.mjs";
import { PATIENCE, troubles } from "./troubles.mjs";

const here = dirname(fileURLToPath(import.meta.url));
const { chromium } = createRequire(join(here, "../../demo/package.json"))("playwright-core");
const [dist, out, executablePath, python] = process.argv.slice(2);
const FLAGS = [
  "--no-sandbox",
  "--disable-gpu",
  "--disable-quic",
  "--no-first-run",
  "--disable-background-networking",
  "--disable-component-update",
  "--disable-sync",
];

const BAD_LINKS = ["tabor=soft", "tabor=0x1", "tabor=1&tabor=2", "force=cubic", "time=real&time=steps", "model=slow"];
BAD_LINKS.push("modulus_ratio=0.3", "model=fast&modulus_ratio=2");

async function download(page, button, name) {
  const [file] = await Promise.all([page.waitForEvent("download"), page.click(button)]);
  await file.saveAs(join(out, name));
  return file.suggestedFilename();
}

async function drag(page, id, pixels) {
  const slider = page.locator(id);
  await slider.scrollIntoViewIfNeeded();
  const box = await slider.boundingBox();
  const share = await slider.evaluate((element) => element.value / element.max);
  const [x, y] = [box.x + 10 + share * (box.width - 20), box.y + box.height / 2];
  await page.mouse.move(x, y);
  await page.mouse.down();
  for (let step = 1; step <= 12; step++) {
    await page.mouse.move(x + (pixels * step) / 12, y);
    await page.waitForTimeout(30);
  }
  await page.mouse.up();
}

const { base, origin, stop } = await serve(join(out, "root"), dist, python);
const seen = { base, errors: [], foreign: [] };
const browser = await chromium.launch({ executablePath, args: FLAGS });
const watch = (page) => {
  page.on("console", (entry) => entry.type() === "error" && seen.errors.push(entry.text()));
  page.on("pageerror", (error) => seen.errors.push(String(error)));
  page.on("request", (request) => {
    const local = [base, "data:", "blob:"].some((start) => request.url().startsWith(start));
    if (!local) seen.foreign.push(request.url());
  });
};
const open = async (fragment, { broken = false, ...options } = {}) => {
  const context = await browser.newContext({ viewport: { width: 1440, height: 900 }, ...options });
  const page = await context.newPage();
  // A page whose files are to be missing reports that they are.
  if (!broken) watch(page);
  await page.goto(base + fragment);
  await settled(page);
  return page;
};
try {
  const page = await open("");
  seen.start = await read(page);
  seen.list = await page.$$eval("#curve-list tr", (rows) =>
    rows.map((row) => [row.dataset.name, Number(row.dataset.error)]),
  );
  seen.isolated = await page.evaluate(() => crossOriginIsolated);
  await page.screenshot({ path: join(out, "light.png"), fullPage: true });

  await page.evaluate(() => {
    window.redraws = 0;
    const count = () => window.redraws++;
    new MutationObserver(count).observe(document.getElementById("results"), { attributeFilter: ["data-address"] });
  });
  const inference = [];
  for (const [id, pixels] of [
    ["#tabor-slider", 90],
    ["#loading_rate-slider", 40],
    ["#dwell_time-slider", -60],
  ]) {
    await drag(page, id, pixels);
    await settled(page);
    inference.push(Number((await read(page)).values.inference));
  }
  seen.dragged = await read(page);
  seen.redraws = await page.evaluate(() => window.redraws);
  seen.inference = inference;
  seen.csvName = await download(page, "#csv", "dragged.csv");
  seen.pngName = await download(page, "#png", "charts.png");
  await page.screenshot({ path: join(out, "dragged.png") });

  await page.focus("#unloading_rate-slider");
  for (const key of ["PageUp", "ArrowRight", "ArrowLeft"]) await page.keyboard.press(key);
  await settled(page);
  await page.waitForFunction(() => !location.hash.includes("unloading_rate=200"));
  await settled(page);
  seen.keyed = Number((await read(page)).protocol.unloading_rate);
  await page.keyboard.press("Shift+Tab");
  await page.keyboard.press("Control+A");
  await page.keyboard.type("123.4");
  await page.waitForFunction(() => location.hash.includes("unloading_rate=123.4"));
  await settled(page);
  seen.typed = await read(page);

  const shared = await open(new URL(page.url()).hash);
  seen.shared = await read(shared);
  await shared.selectOption("#presets", "paper-12");
  await shared.waitForFunction(() => location.hash.startsWith("#tabor=3.2&peak_indentation=15&"));
  await settled(shared);
  seen.preset = await read(shared);
  await download(shared, "#csv", "preset.csv");
  await shared.locator("input[name=force][value=log]").check({ force: true });
  await shared.waitForFunction(() => location.hash.endsWith("&force=log"));
  await shared.screenshot({ path: join(out, "logarithmic.png") });
  const viewed = await open(`${new URL(shared.url()).hash}&time=real&utm_source=a&utm_source=b`);
  seen.viewed = await read(viewed);
  await viewed.context().close();
  await shared.locator("input[name=force][value=linear]").check({ force: true });
  await shared.locator("input[name=time][value=real]").check({ force: true });
  await shared.screenshot({ path: join(out, "true-to-scale.png") });
  await shared.fill("#tabor", "3.5");
  await shared.waitForFunction(() => location.hash.startsWith("#tabor=3.5&"));
  seen.outside = await read(shared);
  await shared.screenshot({ path: join(out, "outside.png") });
  await shared.fill("#tabor", "-1");
  seen.refused = await shared.textContent("#tabor-note");

  seen.badLinks = {};
  for (const fragment of BAD_LINKS) {
    await shared.evaluate((hash) => (location.hash = hash), fragment);
    await shared.waitForSelector("#message:not([hidden])");
    await settled(shared);
    seen.badLinks[fragment] = await read(shared);
    await shared.click("#next");
    await shared.waitForSelector("#message", { state: "hidden", timeout: 5000 });
  }

  const laboratory = await open("#tabor=1.5&peak_indentation=10&loading_rate=10&dwell_time=1&unloading_rate=10");
  await laboratory.locator("input[name=units][value=laboratory]").check({ force: true });
  await laboratory.fill("#radius", "0.05");
  await laboratory.fill("#modulus", "500");
  await laboratory.waitForFunction(() => location.hash.includes("modulus=500000000"));
  seen.laboratory = await read(laboratory);
  await download(laboratory, "#csv", "laboratory.csv");
  await laboratory.screenshot({ path: join(out, "laboratory.png"), fullPage: true });
  const linked = await open(new URL(laboratory.url()).hash);
  seen.linked = await read(linked);
  seen.sketch = await linked.evaluate(async () => (await fetch("./quantities.svg")).status);
  await linked.context().close();
  await laboratory.context().close();

  const canonical = "#tabor=3.2&peak_indentation=15&loading_rate=1000&dwell_time=0.008&unloading_rate=1000";
  const dark = await open(canonical, { colorScheme: "dark" });
  await dark.click("#curve-summary");
  await dark.screenshot({ path: join(out, "dark.png"), fullPage: true });
  await dark.context().close();
  const phone = { viewport: { width: 390, height: 844 }, deviceScaleFactor: 2, hasTouch: true, isMobile: true };
  const small = await open(canonical, phone);
  seen.phone = await read(small);
  await small.screenshot({ path: join(out, "phone.png"), fullPage: true });
  await small.emulateMedia({ colorScheme: "dark" });
  await small.locator("#loading_rate").scrollIntoViewIfNeeded();
  await drag(small, "#tabor-slider", -80);
  await settled(small);
  await small.screenshot({ path: join(out, "phone-dark.png") });
  await small.emulateMedia({ colorScheme: "light" });
  seen.hidden = {};
  seen.stays = {};
  seen.visible = {};
  for (const [width, height] of [
    [390, 844],
    [375, 667],
    [320, 568],
    [667, 375],
    [844, 390],
  ]) {
    await small.setViewportSize({ width, height });
    seen.hidden[`${width}x${height}`] = await hidden(small);
    seen.stays[`${width}x${height}`] = await small.evaluate(
      () => getComputedStyle(document.querySelector(".charts")).position === "sticky",
    );
    await small.locator("#dwell_time-slider").focus();
    seen.visible[`${width}x${height}`] = await visible(small);
    await small.screenshot({ path: join(out, `phone-${width}x${height}.png`) });
    if (width !== 667) continue;
    seen.scroller = await small.evaluate(() => document.querySelector(".charts").tabIndex);
    await small.screenshot({ path: join(out, "phone-landscape.png"), fullPage: true });
  }
  await small.context().close();
  seen.solids = await solids({ open, phone, download, out });
  seen.film = await film({ open, phone, out });
  seen.noScroller = await page.evaluate(() => document.querySelector(".charts").tabIndex);

  // Without a just-in-time compiler there is no WebAssembly either.
  const plain = await chromium.launch({ executablePath, args: [...FLAGS, "--js-flags=--jitless"] });
  seen.messages = await troubles({ browser, plain, base, origin, dist });
  await plain.close();

  const twin = await (await browser.newContext()).newPage();
  for (const path of ["a", "b"]) {
    await twin.goto(`${origin}${path}/`);
    await twin.waitForSelector("body[data-offline=ready]", { timeout: PATIENCE });
  }
  seen.caches = (await twin.evaluate(() => caches.keys())).map((name) => name.replace(origin, "/"));
  await page.waitForSelector("body[data-offline=ready]", { timeout: PATIENCE });
  const before = await read(page);
  await stop();
  await page.reload();
  await settled(page);
  seen.offline = { before, after: await read(page) };
  await twin.goto(`${origin}a/`);
  await settled(twin);
  seen.twin = await read(twin);
  seen.manifest = readFileSync(join(dist, "service-worker.js"), "utf8").split("\n")[1];
} finally {
  await browser.close();
  await stop();
}
writeFileSync(join(out, "seen.json"), JSON.stringify(seen, null, 1));

/**
 * Use the built demonstrator as a person would, in headless Chromium, and write down what was seen.
 *
 * Nothing is judged here: the numbers, messages and screenshots go to a folder, and `check_in_browser.py` compares them.
 *
 * Usage: node drive.mjs DIST FOLDER CHROMIUM PYTHON
 */

import { writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

import { film } from "./film.mjs";
import { corner, hidden, read, settled, visible } from "./looking.mjs";
import { serve } from "./serving.mjs";
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

const BAD_LINKS = ["tabor=soft", "tabor=0x1", "tabor=1&tabor=2", "force=cubic", "time=real&time=phases", "model=slow"];
BAD_LINKS.push("instant=soon", "modulus_ratio=0.3&model=M1-concat", "modulus_ratio=2", "pinned=1,2", "pinned=1,2,3,4,5,soft");

/** For `fast`: each quantity in its range, but a loading and an unloading of rates farther apart than any. */
const UNLIKE = "tabor=0.2&peak_indentation=2&loading_rate=1000&dwell_time=0.001&unloading_rate=0.1&modulus_ratio=0.01";

/** For `fast`: over the whole training and its corners of short steps. */
const CASES = {
  usual: "tabor=1&peak_indentation=20&loading_rate=10&dwell_time=1&unloading_rate=10&modulus_ratio=0.3",
  elastic: "tabor=0.4&peak_indentation=3&loading_rate=1&dwell_time=0.1&unloading_rate=3&modulus_ratio=1",
  quick: "tabor=3.2&peak_indentation=100&loading_rate=1000&dwell_time=0.001&unloading_rate=1000&modulus_ratio=0.02",
  slow: "tabor=0.2&peak_indentation=2&loading_rate=0.1&dwell_time=3&unloading_rate=0.1&modulus_ratio=0.05",
  computed: "tabor=3.2&peak_indentation=15&loading_rate=1000&dwell_time=0.008&unloading_rate=1000&modulus_ratio=0.1",
};

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

/** Drag a corner of the protocol, and look before the mouse is up. */
async function pull(page, number, dx, dy) {
  const [x, y] = await corner(page, number);
  await page.mouse.move(x, y);
  await page.mouse.down();
  for (let step = 1; step <= 10; step++) {
    await page.mouse.move(x + (dx * step) / 10, y + (dy * step) / 10);
    await page.waitForTimeout(30);
  }
  await page.waitForTimeout(200);
  const [left, top] = await corner(page, number);
  const held = { ...(await read(page)), off: [left - x - dx, top - y - dy] };
  await page.mouse.up();
  return held;
}

/** What the page shows, and has fetched, while the file of its model does not arrive. */
async function beforeTheModel(context) {
  const page = await context.newPage();
  let [bytes, arrive] = [0, undefined];
  const held = new Promise((resolve) => (arrive = resolve));
  await page.route("**/fast.bin", async (route) => {
    await held;
    await route.continue();
  });
  const asked = [];
  page.on("response", async (response) => {
    asked.push(response.url());
    const { length } = await response.body().catch(() => "");
    bytes += length;
  });
  await page.goto(base);
  await page.waitForSelector("body[data-state=drawn]", { timeout: PATIENCE });
  await page.waitForSelector("#film[data-shown]");
  const instants = [];
  for (let look = 0; look < 3; look++) {
    await page.waitForTimeout(250);
    instants.push(await page.evaluate(() => document.getElementById("instant").valueAsNumber));
  }
  const found = { ...(await read(page)), bytes, asked: [...asked], instants };
  await page.screenshot({ path: join(out, "first.png") });
  found.dragged = await pull(page, 1, 20, 0);
  arrive();
  await settled(page);
  found.after = await read(page);
  await context.close();
  return found;
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
  seen.first = await beforeTheModel(await browser.newContext({ viewport: { width: 1280, height: 800 }, serviceWorkers: "block" }));
  const page = await open("");
  const asked = [];
  page.on("request", (request) => asked.push(request.url()));
  seen.start = await read(page);
  seen.list = await page.$$eval("#curve-list tr", (rows) =>
    rows.map(({ dataset }) => [dataset.name, Number(dataset.error), Number(dataset.pullOffError)]),
  );
  seen.card = await page.evaluate(() => document.querySelector("meta[property='og:image']").content);
  seen.isolated = await page.evaluate(() => crossOriginIsolated);
  await page.screenshot({ path: join(out, "light.png"), fullPage: true });

  await page.evaluate(() => {
    window.redraws = 0;
    const count = () => window.redraws++;
    new MutationObserver(count).observe(document.getElementById("results"), { attributeFilter: ["data-address"] });
  });
  for (const [id, pixels] of [
    ["#tabor-slider", -60],
    ["#loading_rate-slider", 30],
    ["#dwell_time-slider", -40],
  ]) {
    await drag(page, id, pixels);
    await settled(page);
  }
  seen.dragged = await read(page);
  seen.redraws = await page.evaluate(() => window.redraws);
  seen.csvName = await download(page, "#csv", "dragged.csv");
  seen.pngName = await download(page, "#png", "charts.png");

  seen.corners = {};
  for (const [name, number, dx, dy] of [
    ["peak", 1, 0, 30],
    ["loading", 1, 25, 0],
    ["dwell", 2, -20, 0],
    ["unloading", 3, 15, 0],
    ["beyond", 2, 900, 0],
  ]) {
    const before = await read(page);
    const held = await pull(page, number, dx, dy);
    await settled(page);
    seen.corners[name] = { before, held, after: await read(page) };
  }
  await page.focus("#corner-1");
  seen.keyed = { before: await read(page) };
  await page.keyboard.press("ArrowUp");
  // Faster than the page draws.
  await page.evaluate(() => {
    for (const key of ["ArrowUp", "ArrowRight", "PageUp"]) document.activeElement.dispatchEvent(new KeyboardEvent("keydown", { key }));
  });
  await page.waitForTimeout(300);
  await settled(page);
  seen.keyed.after = await read(page);
  await page.screenshot({ path: join(out, "own.png"), fullPage: true });

  await page.focus("#unloading_rate");
  await page.keyboard.press("Control+A");
  await page.keyboard.type("123.4");
  await page.waitForFunction(() => location.hash.includes("unloading_rate=123.4"));
  await page.click("#pin");
  await page.fill("#dwell_time", "0.5");
  await page.waitForFunction(() => location.hash.includes("dwell_time=0.5&"));
  await settled(page);
  seen.typed = await read(page);
  await page.screenshot({ path: join(out, "pinned.png"), fullPage: true });

  const shared = await open(new URL(page.url()).hash);
  seen.shared = await read(shared);
  await shared.click("#unpin");
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
  await viewed.screenshot({ path: join(out, "true-to-scale.png") });
  await viewed.context().close();
  await shared.locator("input[name=force][value=linear]").check({ force: true });
  await shared.fill("#tabor", "9");
  await shared.waitForFunction(() => location.hash.startsWith("#tabor=9&"));
  await settled(shared);
  seen.outside = await read(shared);
  await shared.screenshot({ path: join(out, "outside.png") });
  const unlike = await open(`#${UNLIKE}`);
  seen.unlike = await read(unlike);
  await unlike.screenshot({ path: join(out, "unlike.png") });
  await unlike.context().close();
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
  seen.asked = asked;

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

  seen.cases = {};
  for (const [name, fragment] of Object.entries(CASES)) {
    const one = await open(`#${fragment}`);
    seen.cases[name] = await read(one);
    await download(one, "#csv", `${name}.csv`);
    await one.context().close();
  }

  // The paper's model, by its choice and by its link.
  const paper = await open("#modulus_ratio=0.3");
  await paper.locator("#model-M1-concat").check({ force: true });
  await paper.waitForFunction(() => location.hash.includes("model=M1-concat"), undefined, { timeout: PATIENCE });
  await settled(paper);
  seen.paper = await read(paper);
  await download(paper, "#csv", "paper.csv");
  seen.paperList = await paper.$$eval("#curve-list tr", (rows) => rows.map(({ dataset }) => [dataset.name, Number(dataset.error)]));
  await paper.screenshot({ path: join(out, "paper.png"), fullPage: true });
  // Of models chosen in a hurry, the last one stays.
  await paper.evaluate(() => ["fast", "M1-concat", "fast"].forEach((name) => document.getElementById(`model-${name}`).click()));
  await settled(paper);
  seen.hurried = await read(paper);
  await paper.context().close();

  const phone = { viewport: { width: 390, height: 844 }, deviceScaleFactor: 2, hasTouch: true, isMobile: true };
  const small = await open("", phone);
  seen.phone = { ...(await read(small)), film: await visible(small, "film"), history: await visible(small, "history") };
  await small.screenshot({ path: join(out, "phone.png") });
  seen.phone.pulled = await pull(small, 2, -30, 0);
  await settled(small);
  seen.phone.after = await read(small);
  await small.screenshot({ path: join(out, "phone-dragged.png") });
  seen.sizes = {};
  for (const [width, height] of [
    [390, 844],
    [375, 667],
    [320, 568],
    [667, 375],
    [844, 390],
  ]) {
    await small.setViewportSize({ width, height });
    await small.waitForTimeout(200);
    const { wide } = await read(small);
    const found = (seen.sizes[`${width}x${height}`] = { wide, hidden: await hidden(small) });
    await small.locator("#dwell_time-slider").focus();
    found.history = await visible(small, "history");
    await small.screenshot({ path: join(out, `phone-${width}x${height}.png`) });
  }
  await small.context().close();
  seen.film = await film({ open, phone, out });

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
} finally {
  await browser.close();
  await stop();
}
writeFileSync(join(out, "seen.json"), JSON.stringify(seen, null, 1));

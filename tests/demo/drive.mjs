/**
 * Use the built demonstrator as a person would, in headless Chromium, and write down what was seen.
 *
 * The page is served by `python -m http.server` below a sub-path. Nothing is judged here: the numbers, messages and
 * screenshots go to a folder, and `check_in_browser.py` compares them.
 *
 * Usage: node drive.mjs DIST FOLDER CHROMIUM PYTHON
 */

import { spawn } from "node:child_process";
import { mkdirSync, readFileSync, symlinkSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { createServer } from "node:net";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const here = dirname(fileURLToPath(import.meta.url));
const { chromium } = createRequire(join(here, "../../demo/package.json"))("playwright-core");
const [dist, out, executablePath, python] = process.argv.slice(2);
const SUB_PATH = "some/sub-path";
const FLAGS = [
  "--no-sandbox",
  "--disable-gpu",
  "--disable-quic",
  "--no-first-run",
  "--disable-background-networking",
  "--disable-component-update",
  "--disable-sync",
];
const PATIENCE = 60_000;

async function freePort() {
  const server = createServer();
  await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
  const { port } = server.address();
  await new Promise((resolve) => server.close(resolve));
  return port;
}

async function serve() {
  const root = join(out, "root");
  mkdirSync(join(root, dirname(SUB_PATH)), { recursive: true });
  symlinkSync(dist, join(root, SUB_PATH));
  const port = await freePort();
  const options = ["-m", "http.server", String(port), "--bind", "127.0.0.1", "--directory", root];
  const server = spawn(python, options, { stdio: "ignore" });
  const base = `http://127.0.0.1:${port}/${SUB_PATH}/`;
  for (let attempt = 0; ; attempt++) {
    try {
      await fetch(base);
      const gone = new Promise((resolve) => server.on("exit", resolve));
      return { base, stop: () => server.kill() && gone };
    } catch (error) {
      if (attempt === 100) throw error;
      await new Promise((resolve) => setTimeout(resolve, 100));
    }
  }
}

const settled = (page) =>
  page.waitForFunction(
    () => {
      const drawn = document.getElementById("results").dataset.protocol;
      if (document.body.dataset.state === "failed") throw new Error(document.getElementById("message").textContent);
      return document.body.dataset.state === "ready" && drawn && location.hash === `#${drawn}`;
    },
    undefined,
    { timeout: PATIENCE },
  );

const read = (page) =>
  page.evaluate(() => {
    const text = (id) => document.getElementById(id).textContent;
    const number = (id) => Number(document.getElementById(id).dataset.value);
    const tiles = ["pull-off-force", "pull-off-time", "hysteresis", "inference"];
    return {
      protocol: Object.fromEntries(new URLSearchParams(location.hash.slice(1))),
      values: Object.fromEntries(tiles.map((id) => [id, number(id)])),
      shown: Object.fromEntries(tiles.map((id) => [id, text(id)])),
      boxes: Object.fromEntries(
        [...document.querySelectorAll(".field [type=number]")].map((box) => [box.id, box.value]),
      ),
      comparison: text("comparison"),
      error: document.getElementById("comparison").dataset.error ?? null,
      extrapolation: document.getElementById("extrapolation").hidden ? null : text("extrapolation"),
      message: document.getElementById("message").hidden ? null : text("message"),
      picked: document.getElementById("presets").value,
      chart: document.getElementById("loop").getAttribute("aria-label"),
      wide: document.documentElement.scrollWidth > document.documentElement.clientWidth,
    };
  });

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

const { base, stop } = await serve();
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
const open = async (fragment, options = {}) => {
  const context = await browser.newContext({ viewport: { width: 1440, height: 900 }, ...options });
  const page = await context.newPage();
  watch(page);
  await page.goto(base + fragment);
  await settled(page);
  return page;
};
/** The message a page ends with whose model answers otherwise. */
const message = async (withBrowser, answer) => {
  const page = await (await withBrowser.newContext({ serviceWorkers: "block" })).newPage();
  if (answer) await page.route("**/model.onnx", (route) => route.fulfill(answer));
  await page.goto(base);
  await page.waitForSelector("body[data-state=failed]", { timeout: PATIENCE });
  const said = await page.textContent("#message");
  await page.context().close();
  return said;
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
    new MutationObserver(count).observe(document.getElementById("results"), { attributeFilter: ["data-protocol"] });
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
  await shared.screenshot({ path: join(out, "logarithmic.png") });
  await shared.locator("input[name=force][value=linear]").check({ force: true });
  await shared.locator("input[name=time][value=real]").check({ force: true });
  await shared.screenshot({ path: join(out, "true-to-scale.png") });
  await shared.fill("#tabor", "5");
  await shared.waitForFunction(() => location.hash.startsWith("#tabor=5&"));
  seen.outside = await read(shared);
  await shared.screenshot({ path: join(out, "outside.png") });
  await shared.fill("#tabor", "-1");
  seen.refused = await shared.textContent("#tabor-note");

  await shared.evaluate(() => (location.hash = "#tabor=soft"));
  await shared.waitForSelector("#message:not([hidden])");
  await settled(shared);
  seen.badLink = await read(shared);

  const canonical = "#tabor=3.2&peak_indentation=15&loading_rate=1000&dwell_time=0.008&unloading_rate=1000";
  const dark = await open(canonical, { colorScheme: "dark" });
  await dark.click("summary");
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
  await small.context().close();

  seen.missing = await message(browser, { status: 404, body: "" });
  seen.notOnnx = await message(browser, { status: 200, body: "<html>not a model</html>" });
  // The prefix of a protocol buffer: ir_version 8, no metadata.
  seen.foreignOnnx = await message(browser, { status: 200, body: Buffer.from([0x08, 0x08]) });
  // Without a just-in-time compiler there is no WebAssembly either.
  const plain = await chromium.launch({ executablePath, args: [...FLAGS, "--js-flags=--jitless"] });
  seen.noWebAssembly = await message(plain);
  await plain.close();

  await page.waitForSelector("body[data-offline=ready]", { timeout: PATIENCE });
  const before = await read(page);
  await stop();
  await page.reload();
  await settled(page);
  seen.offline = { before, after: await read(page) };
  seen.manifest = readFileSync(join(dist, "service-worker.js"), "utf8").split("\n")[1];
} finally {
  await browser.close();
  await stop();
}
writeFileSync(join(out, "seen.json"), JSON.stringify(seen, null, 1));

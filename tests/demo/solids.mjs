/** The pretrained models on the page: any solid, bands, residuals, and what happens where they cannot be had. */

import { join } from "node:path";

import { read, settled, visible } from "./looking.mjs";

/** Over the whole training, its corners of short steps, a dwell below it, and what lies outside. */
const CASES = {
  usual: "tabor=1&peak_indentation=20&loading_rate=10&dwell_time=1&unloading_rate=10&modulus_ratio=0.3",
  elastic: "tabor=0.4&peak_indentation=3&loading_rate=1&dwell_time=0.1&unloading_rate=3&modulus_ratio=1",
  fast: "tabor=3.2&peak_indentation=100&loading_rate=1000&dwell_time=0.001&unloading_rate=1000&modulus_ratio=0.01",
  slow: "tabor=0.2&peak_indentation=2&loading_rate=0.1&dwell_time=3&unloading_rate=0.1&modulus_ratio=0.05",
  brief: "tabor=1&peak_indentation=20&loading_rate=10&dwell_time=0.0002&unloading_rate=100&modulus_ratio=0.1",
  outside: "tabor=1&peak_indentation=20&loading_rate=10&dwell_time=1&unloading_rate=10&modulus_ratio=0.009",
};
const MODELS = ["fast", "accurate"];

async function choose(page, name) {
  await page.locator(`#model-${name}`).check({ force: true });
  const link = name === "paper" ? (hash) => !hash.includes("model=") : (hash) => hash.includes(`model=${name}`);
  const deadline = Date.now() + 30_000;
  while (!link(new URL(page.url()).hash)) {
    if (Date.now() > deadline) throw new Error(`${name} was not chosen`);
    await page.waitForTimeout(50);
  }
  await settled(page);
}

/** What a page says whose file of a pretrained model answers otherwise, and which model it keeps. */
async function failing(open, file, answer) {
  const page = await open("", { serviceWorkers: "block", broken: true });
  await page.route(`**/${file}`, (route) => route.fulfill(answer));
  // A click, and not check(): a file that fails at once returns the choice before check() could confirm it.
  await page.locator("#model-fast").click({ force: true });
  await page.waitForSelector("#message:not([hidden])");
  const said = await page.textContent("#message");
  const kept = await page.evaluate(() => document.querySelector("input[name=model]:checked").id);
  await page.unroute(`**/${file}`);
  // Asked again, it is tried again.
  await page.locator("#model-fast").click({ force: true });
  await page.waitForFunction(() => location.hash.includes("model=fast"));
  await page.context().close();
  return { said, kept };
}

export async function solids({ open, phone, download, out }) {
  const seen = { cases: {}, lists: {} };
  const page = await open("");
  seen.before = await read(page);
  for (const model of MODELS) {
    await choose(page, model);
    seen.lists[model] = await page.$$eval("#curve-list tr", (rows) =>
      rows.map((row) => [row.dataset.name, Number(row.dataset.error), Number(row.dataset.pullOffError)]),
    );
    for (const [name, fragment] of Object.entries(CASES)) {
      const one = await open(`#${fragment}&model=${model}`);
      seen.cases[`${model}-${name}`] = await read(one);
      await download(one, "#csv", `${model}-${name}.csv`);
      await one.context().close();
    }
  }

  await page.focus("#modulus_ratio-slider");
  await page.keyboard.press("PageUp");
  await page.waitForFunction(() => !location.hash.includes("modulus_ratio=0.1&"));
  await settled(page);
  seen.keyed = await read(page);
  await choose(page, "paper");
  seen.back = await read(page);
  await choose(page, "fast");
  seen.again = await read(page);
  await page.fill("#modulus_ratio", "1.5");
  seen.refused = await page.textContent("#modulus_ratio-note");
  await page.fill("#modulus_ratio", "0.005");
  await page.waitForFunction(() => location.hash.includes("modulus_ratio=0.005"));
  await settled(page);
  seen.outside = await read(page);
  await page.screenshot({ path: join(out, "solid-outside.png") });

  await choose(page, "accurate");
  // Of models chosen in a hurry, the last one stays.
  await choose(page, "paper");
  await page.evaluate(() => {
    for (const name of ["fast", "paper", "accurate"]) document.getElementById(`model-${name}`).click();
  });
  await page.waitForFunction(() => location.hash.includes("model=accurate"));
  await settled(page);
  seen.hurried = await read(page);
  await page.selectOption("#presets", "solid-3");
  await page.waitForFunction(() => !location.hash.includes("modulus_ratio=0.005"));
  await settled(page);
  seen.solid = await read(page);
  await download(page, "#csv", "solid.csv");
  seen.pngName = await download(page, "#png", "solid-charts.png");
  for (const [width, height] of [
    [1280, 800],
    [1440, 900],
  ]) {
    await page.setViewportSize({ width, height });
    await page.waitForTimeout(200);
    await page.screenshot({ path: join(out, `solid-${width}x${height}.png`), fullPage: true });
  }
  await page.locator("input[name=units][value=laboratory]").check({ force: true });
  await page.waitForFunction(() => location.hash.includes("units=laboratory"));
  seen.laboratory = await read(page);
  await download(page, "#csv", "solid-laboratory.csv");
  const linked = await open(new URL(page.url()).hash, phone);
  seen.linked = await read(linked);
  seen.visible = {};
  for (const [width, height] of [
    [390, 844],
    [844, 390],
  ]) {
    await linked.setViewportSize({ width, height });
    await linked.locator("#modulus_ratio-slider").focus();
    await linked.locator("#modulus_ratio-slider").scrollIntoViewIfNeeded();
    await linked.waitForTimeout(200);
    seen.visible[`${width}x${height}`] = await visible(linked);
    await linked.screenshot({ path: join(out, `solid-${width}x${height}.png`) });
  }
  await linked.context().close();
  await page.context().close();

  const gone = { status: 404, body: "" };
  seen.failing = {
    missing: await failing(open, "fast.onnx", gone),
    foreign: await failing(open, "fast.onnx", { status: 200, body: "<html>not what was asked for</html>" }),
    curves: await failing(open, "solids.json", { status: 200, body: "null" }),
  };
  return seen;
}

/** The moving contact beside the curve, on a desk and on a phone, and what axe-core says of the page. */

import { join } from "node:path";

import { findings } from "./findings.mjs";
import { read, settled, visible } from "./looking.mjs";

const look = (page) =>
  page.evaluate(() => {
    const film = document.getElementById("film");
    const canvas = film.querySelector("canvas");
    const colours = new Set(new Uint32Array(canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data.buffer));
    return {
      words: film.querySelector("output").textContent,
      instant: film.querySelector("input").valueAsNumber,
      last: Number(film.querySelector("input").max),
      button: film.querySelector("button").getAttribute("aria-label"),
      colours: colours.size,
    };
  });

export async function film({ open, phone, out }) {
  const seen = {};
  for (const [name, options] of Object.entries({ desk: {}, phone, dark: { colorScheme: "dark" } })) {
    const page = await open("", { reducedMotion: "reduce", ...options });
    await page.waitForSelector("#film[data-shown]");
    seen[name] = { start: await look(page), sight: await visible(page, "film") };
    await page.locator("#instant").focus();
    await page.keyboard.press("Home");
    seen[name].apart = await look(page);
    await page.click("#film button");
    await page.waitForFunction(() => document.getElementById("instant").valueAsNumber > 4);
    seen[name].playing = await look(page);
    await page.click("#film button");
    seen[name].paused = await look(page);
    await settled(page);
    const linked = await open(new URL(page.url()).hash, options);
    await linked.waitForSelector("#film[data-shown]");
    seen[name].linked = await look(linked);
    await linked.context().close();
    await page.locator("#instant").focus();
    await page.keyboard.press("End");
    seen[name].end = await look(page);
    seen[name].findings = await findings(page);
    await page.screenshot({ path: join(out, `film-${name}.png`) });
    await page.fill("#tabor", "2.9");
    await page.waitForSelector("#film[data-own=false]");
    await settled(page);
    seen[name].nearest = await read(page);
    await page.selectOption("#presets", "paper-12");
    await page.waitForSelector("#film[data-shown=paper-12]");
    await settled(page);
    seen[name].other = await read(page);
    await page.context().close();
  }
  return seen;
}

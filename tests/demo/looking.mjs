/** What can be seen of the page at a moment. */

import { PATIENCE } from "./troubles.mjs";

/** Waits until the page shows what its address says. */
export const settled = (page) =>
  page.waitForFunction(
    () => {
      const drawn = document.getElementById("results").dataset.address;
      if (document.body.dataset.state === "failed") throw new Error(document.getElementById("message").textContent);
      const { state, model } = document.body.dataset;
      return state === "ready" && model !== "loading" && drawn && location.hash === `#${drawn}`;
    },
    undefined,
    { timeout: PATIENCE },
  );

export const read = (page) =>
  page.evaluate(() => {
    const element = (id) => document.getElementById(id);
    const text = (id) => element(id).textContent;
    const tiles = ["pull-off-force", "pull-off-time", "hysteresis"];
    const all = Object.fromEntries(new URLSearchParams(location.hash.slice(1)));
    const { time, force, units, radius, adhesion, modulus, retardation, model, pinned, instant, ...protocol } = all;
    const chosen = (name) => document.querySelector(`input[name=${name}]:checked`).value;
    const visible = (id) => (element(id).hidden ? null : text(id));
    const ends = element("pull-off-interval").dataset.ends;
    return {
      protocol,
      address: { time: time ?? null, force: force ?? null, model: model ?? null, pinned: pinned ?? null, instant: instant ?? null },
      view: { time: chosen("time"), force: chosen("force") },
      values: Object.fromEntries(tiles.map((id) => [id, Number(element(id).dataset.value || NaN)])),
      contact: { units, radius, adhesion, modulus, retardation },
      units: Object.fromEntries(tiles.map((id) => [id, text(`${id}-unit`)])),
      shown: Object.fromEntries(tiles.map((id) => [id, text(id)])),
      beside: Object.fromEntries(tiles.map((id) => [id, text(`${id}-beside`)])),
      boxes: Object.fromEntries([...document.querySelectorAll(".field [type=number]")].map((box) => [box.id, box.value])),
      fixed: [...document.querySelectorAll(".field [type=number]:disabled")].map((box) => [box.id, box.value]),
      model: chosen("model"),
      interval: ends ? ends.split(",").map(Number) : null,
      comparison: text("comparison"),
      error: element("comparison").dataset.error ?? null,
      outside: visible("outside"),
      message: visible("message"),
      pinned: text("pinned"),
      picked: element("presets").value,
      film: { ...element("film").dataset, caption: document.querySelector("#film figcaption span").textContent },
      corners: [...document.querySelectorAll(".corner")].map((corner) => corner.getAttribute("aria-valuetext")),
      label: document.querySelector("#history canvas").getAttribute("aria-label"),
      wide: document.documentElement.scrollWidth > document.documentElement.clientWidth,
    };
  });

/** Where a corner of the protocol stands in the window. */
export const corner = async (page, number) => {
  const handle = page.locator(`#corner-${number}`);
  await handle.scrollIntoViewIfNeeded();
  const { x, y, width, height } = await handle.boundingBox();
  return [x + width / 2, y + height / 2];
};

/** Controls that the force history hides, or that lie outside the window, once they have the focus. */
export const hidden = (page) =>
  page.evaluate(() => {
    const stage = document.getElementById("history");
    const found = [];
    for (const control of document.querySelectorAll("#side :is(button, select, input):enabled, .corner")) {
      scrollTo(0, document.body.scrollHeight);
      control.focus();
      const [seen, over] = [control.getBoundingClientRect(), stage.getBoundingClientRect()];
      const beside = seen.right <= over.left || over.right <= seen.left;
      const covered = !beside && seen.top < over.bottom && over.top < seen.bottom;
      if (covered || seen.top < -1 || seen.bottom > innerHeight + 1) found.push(control.id || control.value);
    }
    return found;
  });

/** The share of an element that is in sight. */
export const visible = (page, id) =>
  page.evaluate((id) => {
    const { top, bottom, left, right, height, width } = document.getElementById(id).getBoundingClientRect();
    const within = (low, high, end) => Math.max(Math.min(high, end) - Math.max(low, 0), 0);
    return (within(top, bottom, innerHeight) * within(left, right, innerWidth)) / (height * width);
  }, id);

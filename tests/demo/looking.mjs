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
    const text = (id) => document.getElementById(id).textContent;
    const number = (id) => Number(document.getElementById(id).dataset.value);
    const tiles = ["pull-off-force", "pull-off-time", "hysteresis", "inference"];
    const all = Object.fromEntries(new URLSearchParams(location.hash.slice(1)));
    const { time, force, units, radius, adhesion, modulus, retardation, model, ...protocol } = all;
    const { low, high } = document.getElementById("pull-off-interval").dataset;
    const residual = document.getElementById("residual");
    const chosen = (name) => document.querySelector(`input[name=${name}]:checked`).value;
    return {
      protocol,
      address: { time: time ?? null, force: force ?? null },
      view: { time: chosen("time"), force: chosen("force") },
      values: Object.fromEntries(tiles.map((id) => [id, number(id)])),
      contact: { units, radius, adhesion, modulus, retardation },
      units: Object.fromEntries(tiles.slice(0, 3).map((id) => [id, text(`${id}-unit`)])),
      shown: Object.fromEntries(tiles.map((id) => [id, text(id)])),
      boxes: Object.fromEntries(
        [...document.querySelectorAll(".field [type=number]:enabled")].map((box) => [box.id, box.value]),
      ),
      fixed: [...document.querySelectorAll(".field [type=number]:disabled")].map((box) => [box.id, box.value]),
      model: { link: model ?? null, chosen: chosen("model"), named: text("model-name") },
      interval: low === undefined ? null : [low, high, text("pull-off-interval")],
      residual: residual.hidden ? null : residual.getAttribute("aria-label"),
      comparison: text("comparison"),
      error: document.getElementById("comparison").dataset.error ?? null,
      extrapolation: document.getElementById("extrapolation").hidden ? null : text("extrapolation"),
      message: document.getElementById("message").hidden ? null : text("message"),
      picked: document.getElementById("presets").value,
      chart: document.getElementById("loop").getAttribute("aria-label"),
      wide: document.documentElement.scrollWidth > document.documentElement.clientWidth,
    };
  });

/** Controls that the charts hide, or that lie outside the window, once they have the focus. */
export const hidden = (page) =>
  page.evaluate(() => {
    const charts = document.querySelector(".charts");
    const found = [];
    for (const control of document.querySelectorAll(":is(#side button, #side select, #side input):enabled")) {
      scrollTo(0, document.body.scrollHeight);
      control.focus();
      const [seen, stage] = [control.getBoundingClientRect(), charts.getBoundingClientRect()];
      const beside = seen.right <= stage.left || stage.right <= seen.left;
      const covered = !beside && seen.top < stage.bottom && stage.top < seen.bottom;
      if (covered || seen.top < -1 || seen.bottom > innerHeight + 1) found.push(control.id || control.value);
    }
    return found;
  });

/** The share of the force history that is in sight. */
export const visible = (page) =>
  page.evaluate(() => {
    const { top, bottom, left, right, height, width } = document.getElementById("history").getBoundingClientRect();
    const within = (low, high, end) => Math.max(Math.min(high, end) - Math.max(low, 0), 0);
    return (within(top, bottom, innerHeight) * within(left, right, innerWidth)) / (height * width);
  });

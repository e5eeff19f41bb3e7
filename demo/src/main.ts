/** The page: whatever changes the protocol leads to one prediction, and that to one drawing. */

import { fromFragment, toFragment } from "./address";
import { USUAL_VIEW, type View } from "./axes";
import { Controls } from "./controls";
import { curveOf, loadCurves, nearestCurve, number, type Curve, type CurveSet } from "./curves";
import { csv, downloadCsv, downloadPng } from "./downloads";
import { percent, significant } from "./format";
import { forceError, median, pullOff, relativeError } from "./measures";
import { Model } from "./model";
import { Plots } from "./plots";
import { LABELS, measurementGrid, QUANTITIES, type Grid, type Protocol } from "./protocol";
import { listCurves, showComparison, showExtrapolation, showInference, showResults } from "./results";
import { reachable } from "./scrollers";
import { tell, Trouble, untell } from "./trouble";
import { CONTACT, converted, DIMENSIONLESS, unitsOf, USUAL_CONTACT, type Units } from "./units";

const RECENT = 20;
const ADDRESS_DELAY = 150;
const byId = <T extends HTMLElement>(id: string) => document.getElementById(id) as T;

class Page {
  private readonly grids = new Map<Curve, Grid>();
  private readonly controls: Controls;
  private readonly plots: Plots;
  private readonly recent: number[] = [];
  private readonly picker = byId<HTMLSelectElement>("presets");
  private protocol: Protocol;
  private shown?: { protocol: Protocol; grid: Grid; force: Float64Array; curve?: Curve };
  private view = USUAL_VIEW;
  private contact = { ...USUAL_CONTACT };
  private waiting = false;
  private addressTimer?: number;

  constructor(
    private readonly model: Model,
    private readonly set: CurveSet,
  ) {
    const fallback = set.curves[0]!.protocol;
    this.protocol = fallback;
    this.controls = new Controls(byId("controls"), model.ranges, fallback, (protocol) => this.change(protocol));
    this.plots = new Plots({ protocol: byId("protocol"), history: byId("history"), loop: byId("loop") });
    for (const curve of set.curves) this.grids.set(curve, measurementGrid(curve.protocol, set.counts));
    this.fillPicker();
    this.listen(fallback);
    this.open(location.hash, fallback);
  }

  /** Predict all published protocols at once and list the errors. */
  async compareAll(): Promise<void> {
    const cases = this.set.curves.map((curve) => ({ protocol: curve.protocol, grid: this.grids.get(curve)! }));
    const predictions = await this.model.predict(cases);
    const rows = this.set.curves.map((curve, i) => {
      const { grid } = cases[i]!;
      const { force } = predictions[i]!;
      const pullOffError = relativeError(pullOff(grid, force).force, pullOff(grid, curve.force).force);
      return { curve, error: forceError(force, curve.force), pullOffError };
    });
    listCurves(rows, (curve) => this.show(curve.protocol));
    byId("curve-summary").textContent =
      `Solver curves of ${rows.length} published protocols: median force error ${percent(median(rows.map((row) => row.error)))}, ` +
      `median pull-off error ${percent(median(rows.map((row) => row.pullOffError)))}`;
  }

  private fillPicker(): void {
    const group = (label: string, kind: Curve["kind"]) => {
      const element = document.createElement("optgroup");
      element.label = label;
      for (const curve of this.set.curves.filter((candidate) => candidate.kind === kind)) {
        const { tabor, peak_indentation } = curve.protocol;
        const text = `${number(curve)}: μ ${significant(tabor, 3)}, δₗ ${significant(peak_indentation, 3)}`;
        element.append(new Option(text, curve.name));
      }
      return element;
    };
    this.picker.append(
      new Option("your own", ""),
      group("The paper’s representative samples", "paper"),
      group("Test trajectories of the data set", "test"),
    );
  }

  private listen(fallback: Protocol): void {
    this.picker.addEventListener("change", () => {
      const curve = this.set.curves.find((candidate) => candidate.name === this.picker.value);
      if (curve) this.show(curve.protocol);
    });
    for (const [id, direction] of [
      ["previous", -1],
      ["next", 1],
    ] as const) {
      byId(id).addEventListener("click", () => this.turn(direction));
    }
    for (const input of document.querySelectorAll<HTMLInputElement>("input[name=time], input[name=force], input[name=units]")) {
      input.addEventListener("change", () => {
        this.view = { ...this.view, [input.name]: input.value } as View;
        this.draw();
      });
    }
    for (const name of CONTACT) {
      const box = byId<HTMLInputElement>(name);
      box.addEventListener("input", () => {
        const value = box.valueAsNumber * Number(box.dataset["scale"]);
        const usable = value > 0 && Number.isFinite(value);
        box.setAttribute("aria-invalid", String(!usable));
        if (!usable) return;
        this.contact[name] = value;
        this.draw();
      });
    }
    byId("csv").addEventListener("click", () => {
      const { protocol, grid, force, curve } = this.shown!;
      downloadCsv(csv(protocol, grid, force, this.units(protocol), curve?.force), protocol);
    });
    byId("png").addEventListener("click", () => downloadPng(this.plots.png(), this.shown!.protocol));
    byId("share").addEventListener("click", () => void this.share());
    addEventListener("hashchange", () => this.open(location.hash, fallback));
  }

  private turn(direction: number): void {
    const { curves } = this.set;
    const at = curves.findIndex((curve) => curve === curveOf(curves, this.protocol));
    const next = at < 0 ? (direction > 0 ? 0 : curves.length - 1) : (at + direction + curves.length) % curves.length;
    this.show(curves[next]!.protocol);
  }

  private open(fragment: string, fallback: Protocol): void {
    try {
      const { protocol, view, contact } = fromFragment(fragment, fallback);
      this.contact = contact;
      this.look(view);
      this.show(protocol);
    } catch (error) {
      this.show(fallback);
      tell(`${(error as Error).message} Showing the first of the paper’s samples instead.`);
    }
  }

  private look(view: View): void {
    this.view = view;
    for (const [axis, value] of Object.entries(view)) {
      document.querySelector<HTMLInputElement>(`input[name=${axis}][value=${value}]`)!.checked = true;
    }
    for (const name of CONTACT) {
      const box = byId<HTMLInputElement>(name);
      box.value = String(Number((this.contact[name] / Number(box.dataset["scale"])).toPrecision(6)));
    }
  }

  private async share(): Promise<void> {
    this.writeAddress();
    try {
      await navigator.clipboard.writeText(location.href);
      byId("share-note").textContent = "Link copied.";
    } catch {
      byId("share-note").textContent = "The address bar holds the link.";
    }
    setTimeout(() => (byId("share-note").textContent = ""), 4000);
  }

  private show(protocol: Protocol): void {
    this.controls.show(protocol);
    this.change(protocol);
  }

  private change(protocol: Protocol): void {
    untell();
    this.protocol = protocol;
    if (!this.waiting) void this.predict();
  }

  /** One prediction at a time; what changes meanwhile is predicted next. */
  private async predict(): Promise<void> {
    this.waiting = true;
    try {
      let done: Protocol;
      do {
        done = this.protocol;
        const grid = measurementGrid(done, this.set.counts);
        const [prediction] = await this.model.predict([{ protocol: done, grid }]);
        this.recent.push(prediction!.milliseconds);
        if (this.recent.length > RECENT) this.recent.shift();
        this.shown = { protocol: done, grid, force: prediction!.force, curve: curveOf(this.set.curves, done) };
        await new Promise(requestAnimationFrame);
        this.draw();
      } while (done !== this.protocol);
    } catch (error) {
      tell(error instanceof Trouble ? error.message : `The prediction failed (${String(error)}).`);
    } finally {
      this.waiting = false;
    }
  }

  private units(protocol: Protocol): Units {
    return this.view.units === "laboratory" ? unitsOf(this.contact, protocol.tabor) : DIMENSIONLESS;
  }

  private draw(): void {
    if (!this.shown) return;
    byId("contact").hidden = this.view.units !== "laboratory";
    const { protocol, grid, force, curve } = this.shown;
    const outside = this.model.outside(protocol);
    const caption = QUANTITIES.map((name) => `${LABELS[name].brief}\u00a0${significant(protocol[name], 4)}`).join(" · ");
    const units = this.units(protocol);
    const drawn = converted(grid, force, curve?.force, units);
    this.plots.draw(
      { ...drawn, pullOff: pullOff(drawn.grid, drawn.force), extrapolated: outside.length > 0, caption },
      this.view,
    );
    showResults(grid, force, curve, units);
    showInference(median(this.recent));
    showComparison(grid, force, curve, nearestCurve(this.set.curves, protocol), (chosen) => this.show(chosen.protocol));
    showExtrapolation(outside);
    this.picker.value = curve?.name ?? "";
    byId("results").dataset["address"] = toFragment(protocol, this.view, this.contact);
    clearTimeout(this.addressTimer);
    // Browsers limit how often the address may change; a drag changes it far more often.
    this.addressTimer = window.setTimeout(() => this.writeAddress(), ADDRESS_DELAY);
  }

  private writeAddress(): void {
    history.replaceState(null, "", `#${toFragment(this.shown!.protocol, this.view, this.contact)}`);
  }
}

async function keepForOffline(): Promise<void> {
  if (!("serviceWorker" in navigator)) return;
  await navigator.serviceWorker.register("./service-worker.js");
  await navigator.serviceWorker.ready;
  byId("offline").textContent = "Loaded: the page now also works offline.";
  document.body.dataset["offline"] = "ready";
}

async function start(): Promise<void> {
  if (typeof WebAssembly === "undefined") {
    throw new Trouble(
      "This browser runs no WebAssembly, which the surrogate needs; switch it on, or use a current browser.",
    );
  }
  const [model, set] = await Promise.all([Model.load("./model.onnx", "./ort.wasm"), loadCurves("./curves.json")]);
  byId("model-name").textContent = model.name;
  byId("demonstrator").hidden = false;
  const page = new Page(model, set);
  for (const box of document.querySelectorAll<HTMLElement>(".charts, .scroll")) reachable(box);
  await page.compareAll();
  byId("progress").hidden = true;
  document.body.dataset["state"] = "ready";
  await keepForOffline().catch(() => {
    byId("offline").textContent = "This browser does not keep the page for offline use.";
  });
}

document.body.dataset["state"] = "loading";
start().catch((error: unknown) => {
  byId("progress").hidden = true;
  tell(error instanceof Trouble ? error.message : `The page could not be started (${String(error)}).`);
  document.body.dataset["state"] = "failed";
});

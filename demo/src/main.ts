/** The page: whatever changes protocol or model leads to one prediction, and that to one drawing. */

import { fromFragment, toFragment, type State } from "./address";
import { Film, loadProfiles, type Profiles } from "./contact";
import { Controls } from "./controls";
import { curveOf, nearestCurve, type Curve } from "./curves";
import { csv, downloadCsv, downloadPng, fileName } from "./downloads";
import { percent, significant } from "./format";
import { forceError, median, relativeError } from "./measures";
import type { Prediction } from "./model";
import { PRETRAINED_NAMES } from "./model_file";
import { Picker } from "./picker";
import { Plots } from "./plots";
import { LABELS, QUANTITIES, type Protocol } from "./protocol";
import { listCurves, showComparison, showExtrapolation, showInference, showResults, solverResults } from "./results";
import { reachable } from "./scrollers";
import { Shelf, type Loaded } from "./shelf";
import { tell, Trouble, untell } from "./trouble";
import { converted, DIMENSIONLESS, unitsOf, type Units } from "./units";
import { ViewControls } from "./view_controls";

const RECENT = 20;
const ADDRESS_DELAY = 150;
const byId = <T extends HTMLElement>(id: string) => document.getElementById(id) as T;

class Page {
  private readonly controls: Controls;
  private readonly picker: Picker;
  private readonly plots: Plots;
  private readonly film: Film;
  /** The contacts of the solver's curves, once they are loaded. */
  private profiles?: Map<string, Profiles>;
  private readonly look: ViewControls;
  private readonly fallback: Protocol;
  private recent: number[] = [];
  /** How often a model was asked for: the last one asked for is shown. */
  private turns = 0;
  private loaded: Loaded;
  /** The name of a pretrained model; undefined for the paper's. */
  private chosen?: string;
  private protocol: Protocol;
  /** The modulus ratio that a pretrained model had last, while the paper's model shows its own. */
  private ratio: number;
  private shown?: { protocol: Protocol; prediction: Prediction; curve?: Curve; by: Loaded; chosen?: string };
  private waiting = false;
  private addressTimer?: number;

  constructor(private readonly shelf: Shelf) {
    this.loaded = shelf.paper;
    this.fallback = this.loaded.set.curves[0]!.protocol;
    this.protocol = this.fallback;
    this.ratio = this.fallback.modulus_ratio;
    const { ranges } = this.loaded.model;
    this.controls = new Controls(byId("controls"), ranges, this.fallback, (protocol) => this.change(protocol));
    const [protocol, history, loop, residual] = ["protocol", "history", "loop", "residual"].map((id) => byId(id));
    this.plots = new Plots({ protocol: protocol!, history: history!, loop: loop!, residual: residual! });
    this.film = new Film(byId("film"), (step) => this.plots.mark(step));
    this.picker = new Picker(
      () => this.protocol,
      (curve) => this.show(curve.protocol),
    );
    this.look = new ViewControls(() => this.draw());
    this.listen();
  }

  /** Show what the address says. */
  async open(): Promise<void> {
    try {
      const { protocol, view, contact, model } = fromFragment(
        location.hash,
        this.fallback,
        this.shelf.paper.model.name,
      );
      if (!(await this.take(model))) return;
      this.look.show(view, contact);
      this.show(protocol);
    } catch (error) {
      await this.take(undefined);
      this.show(this.fallback);
      tell(`${(error as Error).message} Showing the first of the paper’s samples instead.`);
    }
  }

  /**
   * Load the contacts of the solver's curves, which the page also does without.
   *
   * @throws Trouble where they cannot be had.
   */
  async watch(): Promise<void> {
    this.profiles = await loadProfiles();
    this.draw();
  }

  /**
   * Put a model on the page, with its ranges and its solver curves.
   *
   * @returns Whether it is on the page: not where another one was asked for meanwhile.
   * @throws Trouble where it cannot be had; the model before stays.
   */
  private async take(chosen: string | undefined): Promise<boolean> {
    const turn = ++this.turns;
    document.body.dataset["model"] = "loading";
    try {
      const loaded = await this.shelf.get(chosen);
      if (turn !== this.turns) return false;
      this.loaded = loaded;
      this.chosen = chosen;
    } catch (error) {
      if (turn !== this.turns) return false;
      throw error;
    } finally {
      if (turn === this.turns) byId<HTMLInputElement>(`model-${this.chosen ?? "paper"}`).checked = true;
    }
    const { model, set } = this.loaded;
    this.recent = [];
    const others = PRETRAINED_NAMES.join(" and ");
    this.controls.suit(model.ranges, `${model.name} knows this solid only; ${others} know any.`);
    this.picker.fill(set.curves);
    byId("steps").textContent = String(set.counts.reduce((sum, count) => sum + count));
    await this.compareAll();
    if (turn === this.turns) document.body.dataset["model"] = model.name;
    return turn === this.turns;
  }

  /** Change to another model, and keep the protocol. */
  private async choose(chosen: string | undefined): Promise<void> {
    try {
      if (!(await this.take(chosen))) return;
    } catch (error) {
      document.body.dataset["model"] = this.loaded.model.name;
      tell(`${(error as Error).message} The model before stays.`);
      return;
    }
    const ratio = this.loaded.model.banded ? this.ratio : this.fallback.modulus_ratio;
    this.show({ ...this.protocol, modulus_ratio: ratio });
  }

  /** Predict all published protocols at once and list the errors. */
  private async compareAll(): Promise<void> {
    const { model, set } = this.loaded;
    const predictions = await model.predict(set.curves.map((curve) => curve.protocol));
    const rows = set.curves.map((curve, i) => {
      const { grid, force, pullOff } = predictions[i]!;
      const top = solverResults(grid, curve, model.banded).pull_off_force;
      return { curve, error: forceError(force, curve.force), pullOffError: relativeError(pullOff.force, top) };
    });
    listCurves(rows, (curve) => this.show(curve.protocol));
    byId("curve-summary").textContent =
      `Solver curves of ${rows.length} published protocols: median force error ${percent(median(rows.map((row) => row.error)))}, ` +
      `median pull-off error ${percent(median(rows.map((row) => row.pullOffError)))}`;
  }

  private listen(): void {
    for (const input of document.querySelectorAll<HTMLInputElement>("input[name=model]")) {
      input.addEventListener("change", () => void this.choose(input.value || undefined));
    }
    const file = () => fileName(this.shown!.protocol, this.shown!.chosen);
    byId("csv").addEventListener("click", () => {
      const { protocol, prediction, curve } = this.shown!;
      downloadCsv(csv(protocol, prediction, this.units(protocol), curve?.force), file());
    });
    byId("png").addEventListener("click", () => downloadPng(this.plots.png(), file()));
    byId("share").addEventListener("click", () => void this.share());
    addEventListener("hashchange", () => void this.open());
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
    // A copy, so that a prediction under way sees that it is no longer the one asked for.
    this.protocol = { ...protocol };
    if (this.loaded.model.banded) this.ratio = protocol.modulus_ratio;
    if (!this.waiting) void this.predict();
  }

  /** One prediction at a time; what changes meanwhile is predicted next. */
  private async predict(): Promise<void> {
    this.waiting = true;
    try {
      let done: Protocol;
      do {
        done = this.protocol;
        const by = this.loaded;
        const chosen = this.chosen;
        const [prediction] = await by.model.predict([done]);
        this.recent.push(prediction!.milliseconds);
        if (this.recent.length > RECENT) this.recent.shift();
        this.shown = { protocol: done, prediction: prediction!, curve: curveOf(by.set.curves, done), by, chosen };
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
    const { view, contact } = this.look;
    return view.units === "laboratory" ? unitsOf(contact, protocol.tabor) : DIMENSIONLESS;
  }

  private draw(): void {
    if (!this.shown) return;
    const { view } = this.look;
    byId("contact").hidden = view.units !== "laboratory";
    const { protocol, prediction, curve, by } = this.shown;
    const { model, set } = by;
    byId("model-name").textContent = model.name;
    byId("solid").textContent = significant(protocol.modulus_ratio, 3);
    const outside = model.outside(protocol);
    const named = QUANTITIES.filter((name) => model.banded || name !== "modulus_ratio");
    const caption = named.map((name) => `${LABELS[name].brief}\u00a0${significant(protocol[name], 4)}`).join(" · ");
    const units = this.units(protocol);
    const drawn = converted(prediction, curve?.force, units);
    this.plots.draw({ ...drawn, extrapolated: outside.length > 0, caption }, view);
    const contact = curve && this.profiles?.get(curve.name);
    const { grid } = prediction;
    const filmed = { grid, tabor: protocol.tabor, force: curve?.force ?? [], pullOffTime: curve?.results.pull_off_time ?? 0 };
    this.film.show(contact && { contact, ...filmed });
    showResults(prediction, curve, units);
    showInference(median(this.recent));
    showComparison(prediction, curve, nearestCurve(set.curves, protocol), (chosen) => this.show(chosen.protocol));
    showExtrapolation(outside, model.banded);
    this.picker.mark(curve);
    byId("results").dataset["address"] = toFragment(this.state());
    clearTimeout(this.addressTimer);
    // Browsers limit how often the address may change; a drag changes it far more often.
    this.addressTimer = window.setTimeout(() => this.writeAddress(), ADDRESS_DELAY);
  }

  private state(): State {
    const { protocol, chosen } = this.shown!;
    return { protocol, view: this.look.view, contact: this.look.contact, model: chosen };
  }

  private writeAddress(): void {
    history.replaceState(null, "", `#${toFragment(this.state())}`);
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
  const shelf = await Shelf.open();
  byId("paper-name").textContent = shelf.paper.model.name;
  byId("demonstrator").hidden = false;
  const page = new Page(shelf);
  await page.open();
  await page.watch().catch((error: Error) => tell(`${error.message} The page shows the curves without it.`));
  for (const box of document.querySelectorAll<HTMLElement>(".charts, .scroll")) reachable(box);
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

/** The page: whatever changes protocol or model leads to one prediction, and that to one drawing. */

import { fromFragment, toFragment, type State } from "./address";
import { Film } from "./contact";
import { Controls } from "./controls";
import { curveOf, loadCurves, nearestCurve, type Curve, type CurveSet } from "./curves";
import { csv, downloadCsv, downloadPng, fileName } from "./downloads";
import { percent } from "./format";
import { forceError, median, relativeError } from "./measures";
import { outside, type Prediction, type Ranges } from "./model";
import { Picker } from "./picker";
import { Plots } from "./plots";
import { measurementGrid, type Grid, type Protocol } from "./protocol";
import { pullOffGrid } from "./pull_off_steps";
import { brief, forceOfSolver, listCurves, ofSolver, showComparison, showOutside, showResults, type Computed } from "./results";
import { reachable } from "./scrollers";
import { MODELS, Shelf, type Loaded, type Name } from "./shelf";
import { tell, Trouble, untell } from "./trouble";
import { DIMENSIONLESS, unitsOf, type Units } from "./units";
import { ViewControls } from "./view_controls";

/** Of `fast`, so that the page has its sliders before that: the build reads them off its file. */
declare const FAST_RANGES: Ranges;
/** The computed protocol with which the page opens. */
const OPENING = "paper-4";
const ADDRESS_DELAY = 150;
const byId = <T extends HTMLElement>(id: string) => document.getElementById(id) as T;

interface Shown {
  protocol: Protocol;
  prediction?: Prediction;
  pinned?: Prediction;
  computed?: Computed;
  /** Whether the model knows each quantity, but not their combination. */
  unlike: boolean;
}

class Page {
  private readonly controls: Controls;
  private readonly picker: Picker;
  private readonly plots: Plots;
  private readonly film: Film;
  private readonly look: ViewControls;
  private readonly fallback: Protocol;
  /** How often a model was asked for: the last one asked for is shown. */
  private turns = 0;
  private chosen: Name = MODELS[0];
  /** Undefined until the first model is there. */
  private loaded?: Loaded;
  /** Whose errors are listed. */
  private listed?: Loaded;
  private protocol: Protocol;
  private pinned?: Protocol;
  private shown?: Shown;
  private waiting = false;
  private addressTimer?: number;

  constructor(private readonly shelf: Shelf) {
    const { curves } = shelf.solids;
    this.fallback = (curves.find(({ name }) => name === OPENING) ?? curves[0]!).protocol;
    this.protocol = this.fallback;
    this.controls = new Controls(byId("controls"), FAST_RANGES, this.fallback, (protocol) => this.change(protocol));
    const [history, loop, protocol] = ["history", "loop", "protocol"].map((id) => byId(id));
    const drawn = { history: history!, loop: loop!, protocol: protocol! };
    const current = () => this.protocol;
    this.plots = new Plots(drawn, current, (changed) => this.show(changed));
    this.film = new Film(byId("film"), (time) => {
      this.plots.mark(this.shown?.computed ? time : undefined);
      if (this.shown) this.note();
    });
    this.picker = new Picker(current, (curve) => this.show(curve.protocol));
    this.picker.fill(curves);
    this.look = new ViewControls(() => this.draw());
    this.listen();
  }

  /** Show what the address says: what is computed at once, and then a prediction. */
  async open(): Promise<void> {
    let state: State = { protocol: this.fallback, view: this.look.view, contact: this.look.contact, model: MODELS[0] };
    let trouble = "";
    try {
      state = fromFragment(location.hash, this.fallback, this.shelf.solids.modulus_ratio);
    } catch (error) {
      trouble = `${(error as Error).message} Showing the first protocol instead.`;
    }
    this.look.show(state.view, state.contact);
    this.pinned = state.pinned;
    this.film.seek(state.instant);
    await this.show(state.protocol);
    if (this.loaded === undefined) document.body.dataset["state"] = "drawn";
    if (trouble) tell(trouble);
    await this.choose(state.model, true);
  }

  /**
   * Put a model on the page, with its ranges and its solver curves.
   *
   * @param stay Keeps the protocol also where the model knows one solid only.
   */
  private async choose(chosen: Name, stay = false): Promise<void> {
    const turn = ++this.turns;
    document.body.dataset["model"] = "loading";
    byId("loading").textContent = this.loaded?.model.name === chosen ? "" : `Loading ${chosen}…`;
    const before = this.loaded;
    try {
      const loaded = await this.shelf.get(chosen);
      if (turn !== this.turns) return;
      [this.loaded, this.chosen] = [loaded, chosen];
    } catch (error) {
      if (turn !== this.turns) return;
      const kept = this.loaded ? "The model before stays." : "The page shows what the solver has computed.";
      tell(`${error instanceof Trouble ? error.message : String(error)} ${kept}`);
    }
    byId("loading").textContent = "";
    byId<HTMLInputElement>(`model-${this.chosen}`).checked = true;
    if (this.loaded && this.loaded !== before) this.suit(this.loaded);
    const ratio = this.chosen === "fast" || stay ? this.protocol.modulus_ratio : this.shelf.solids.modulus_ratio;
    const next = { ...this.protocol, modulus_ratio: ratio };
    this.controls.show(next);
    this.protocol = next;
    await this.predict();
    if (this.loaded && this.loaded !== this.listed) await this.compareAll(this.loaded, turn);
    if (turn !== this.turns) return;
    document.body.dataset["model"] = this.loaded?.model.name ?? "none";
  }

  private suit({ model, set }: Loaded): void {
    this.controls.suit(model.ranges, `${model.name} knows this solid only; fast knows any.`);
    this.plots.corners.ranges = model.ranges;
    this.picker.fill(set.curves);
    byId("steps").textContent = String(set.counts.reduce((sum, count) => sum + count));
  }

  /** Predict all computed protocols and list the errors; film and reader go on between them. */
  private async compareAll(loaded: Loaded, turn: number): Promise<void> {
    const { model, set } = loaded;
    const rows = [];
    for (const curve of set.curves) {
      await new Promise((resolve) => setTimeout(resolve));
      const prediction = await model.predict(curve.protocol);
      if (turn !== this.turns) return;
      if (!prediction) continue;
      const computed = { curve, grid: this.grid(curve, set) };
      const [top] = ofSolver(computed, prediction.band !== undefined);
      const error = forceError(prediction.force, forceOfSolver(computed, prediction));
      rows.push({ curve, error, pullOffError: relativeError(prediction.pullOff.force, top) });
    }
    this.listed = loaded;
    listCurves(rows, (curve) => this.show(curve.protocol));
    byId("curve-summary").textContent =
      `The ${rows.length} computed protocols: median force error ${percent(median(rows.map((row) => row.error)))}, ` +
      `median pull-off error ${percent(median(rows.map((row) => row.pullOffError)))}`;
  }

  private listen(): void {
    for (const name of MODELS) byId(`model-${name}`).addEventListener("change", () => void this.choose(name));
    byId("csv").addEventListener("click", () => {
      const { protocol, prediction, computed } = this.shown!;
      if (!prediction) return;
      const solver = computed && forceOfSolver(computed, prediction);
      downloadCsv(csv(protocol, prediction, this.units(protocol), solver), this.file());
    });
    byId("png").addEventListener("click", () => {
      const [film, caption] = ["canvas", "figcaption span"].map((part) => byId("film").querySelector(part)!);
      downloadPng(this.plots.png(film as HTMLCanvasElement, caption!.textContent), this.file());
    });
    byId("share").addEventListener("click", () => void this.share());
    byId("pin").addEventListener("click", () => this.pin(this.protocol));
    byId("unpin").addEventListener("click", () => this.pin(undefined));
    addEventListener("hashchange", () => void this.open());
  }

  private file(): string {
    return fileName(this.shown!.protocol, this.chosen);
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

  private pin(protocol: Protocol | undefined): void {
    this.pinned = protocol;
    void this.change(this.protocol);
  }

  private show(protocol: Protocol): Promise<void> {
    this.controls.show(protocol);
    return this.change(protocol);
  }

  private async change(protocol: Protocol): Promise<void> {
    untell();
    // A copy, so that a prediction under way sees that it is no longer the one asked for.
    this.protocol = { ...protocol };
    if (!this.waiting) await this.predict();
  }

  /** One prediction at a time; what changes meanwhile is predicted next. */
  private async predict(): Promise<void> {
    this.waiting = true;
    try {
      let done: Protocol;
      do {
        done = this.protocol;
        const pinned = this.pinned && (await this.ask(this.pinned));
        const prediction = await this.ask(done);
        const unlike = !prediction && this.knows(done);
        this.shown = { protocol: done, prediction, pinned, computed: this.computed(done), unlike };
        await new Promise(requestAnimationFrame);
        this.draw();
      } while (done !== this.protocol);
    } catch (error) {
      tell(error instanceof Trouble ? error.message : `The prediction failed (${String(error)}).`);
    } finally {
      this.waiting = false;
    }
  }

  /** Whether there is a model, and its training covers each quantity of a protocol. */
  private knows(protocol: Protocol): boolean {
    return this.loaded !== undefined && outside(protocol, this.loaded.model.ranges).length === 0;
  }

  private async ask(protocol: Protocol): Promise<Prediction | undefined> {
    return this.knows(protocol) ? this.loaded!.model.predict(protocol) : undefined;
  }

  private computed(protocol: Protocol): Computed | undefined {
    const set = this.loaded?.set ?? this.shelf.solids;
    const curve = curveOf(set.curves, protocol);
    return curve && { curve, grid: this.grid(curve, set) };
  }

  /** The steps of a curve: around its pull-off, or the paper's. */
  private grid({ protocol, results }: Curve, set: CurveSet): Grid {
    if (set === this.shelf.solids) return pullOffGrid(protocol, set.counts, results.pull_off_time);
    return measurementGrid(protocol, set.counts);
  }

  private units({ tabor }: Protocol): Units {
    const { view, contact } = this.look;
    return view.units === "laboratory" ? unitsOf(contact, tabor) : DIMENSIONLESS;
  }

  private draw(): void {
    if (!this.shown) return;
    const { view } = this.look;
    byId("contact").hidden = view.units !== "laboratory";
    const { protocol, prediction, pinned, computed, unlike } = this.shown;
    const units = this.units(protocol);
    this.plots.draw({
      ...{ protocol, prediction, units, view },
      computed: computed && { grid: computed.grid, force: computed.curve.force },
      pinned: this.pinned && pinned && { protocol: this.pinned, prediction: pinned },
    });
    const { solids } = this.shelf;
    const nearest = nearestCurve((this.loaded?.set ?? solids).curves, protocol);
    const filmed = solids.curves.find(({ name }) => name === nearest.name)!;
    this.film
      .show(filmed, this.grid(filmed, solids), computed !== undefined, this.units(filmed.protocol))
      .catch((error: Error) => tell(`${error.message} The page shows the curves without it.`));
    const name = this.loaded?.model.name ?? this.chosen;
    showResults(prediction, computed, pinned, units, name);
    showComparison(prediction, computed, nearest, (chosen: Curve) => this.show(chosen.protocol));
    const ranges = this.loaded?.model.ranges ?? FAST_RANGES;
    showOutside(outside(protocol, ranges), ranges, name, unlike);
    this.picker.mark(computed?.curve);
    byId("unpin").hidden = !this.pinned;
    byId("pinned").textContent = this.pinned ? `Pinned: ${brief(this.pinned)}` : "";
    byId<HTMLButtonElement>("csv").disabled = !prediction;
    this.note(true);
  }

  /** Bring the address in line with what is shown; `anew` also where only the reader has changed it. */
  private note(anew = false): void {
    const { dataset } = byId("results");
    const before = dataset["address"];
    dataset["address"] = toFragment(this.state());
    if (dataset["address"] === before && !anew) return;
    clearTimeout(this.addressTimer);
    // Browsers limit how often the address may change; a drag changes it far more often.
    this.addressTimer = window.setTimeout(() => this.writeAddress(), ADDRESS_DELAY);
  }

  private state(): State {
    const { view, contact } = this.look;
    return { protocol: this.shown!.protocol, view, contact, model: this.chosen, pinned: this.pinned, instant: this.film.instant };
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
  const shelf = new Shelf(await loadCurves("./solids.json"));
  byId("demonstrator").hidden = false;
  byId("progress").hidden = true;
  const page = new Page(shelf);
  await page.open();
  for (const box of document.querySelectorAll<HTMLElement>(".scroll")) reachable(box);
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

/**
 * The contact itself, of a computed protocol: sphere, surface, and traction as colour, on a canvas with a slider and a
 * play button. The profiles are written by `python -m experiments.demo_curves`, on equally spaced radii; the build puts
 * each protocol's into a file of its own, so that the first picture needs one of them.
 *
 * Units: radius in β, heights in h0, traction in Δγ / h0, positive in tension.
 */

import { title, type Curve } from "./curves";
import { fetchFile } from "./files";
import { significant } from "./format";
import { colours } from "./ink";
import { linearly, nearest, type Grid } from "./protocol";
import { Trouble } from "./trouble";
import { DIMENSIONLESS, handy, type Units } from "./units";

/** Pause between two pictures in ms, and how far one is from the next, in recorded instants. */
const PAUSE = 40;
const STRIDE = 0.4;
const WHAT = "The profiles of the contact";

interface Entry {
  nodes: number;
  /** The largest radius. */
  reach: number;
  times: number[];
  /** The surface's height, 16 bits from `low` to `high`, and the traction, 8 bits around 128 to `push` and `pull`. */
  low: number;
  high: number;
  push: number;
  pull: number;
  surface: string;
  traction: string;
}

interface Profiles extends Omit<Entry, "surface" | "traction"> {
  surface: Float64Array;
  /** From -1, the strongest push, to 1, the strongest pull. */
  traction: Float64Array;
}

const bytes = (text: string) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));

/**
 * The contact of a curve.
 *
 * @throws Trouble where it cannot be had.
 */
async function loadProfiles(name: string): Promise<Profiles> {
  const file = `./contact-${name}.json`;
  const content = new TextDecoder().decode(await fetchFile(file, WHAT));
  try {
    return unpacked(JSON.parse(content) as Entry);
  } catch {
    throw new Trouble(`${WHAT} could not be read: ${file} is not what the build writes.`);
  }
}

function unpacked(entry: Entry): Profiles {
  const [heights, tractions] = [bytes(entry.surface), bytes(entry.traction)];
  const size = entry.nodes * entry.times.length;
  if (heights.length !== 2 * size || tractions.length !== size) throw new Error("cut");
  const view = new DataView(heights.buffer);
  const surface = Float64Array.from({ length: size }, (_, i) => {
    return entry.low + ((entry.high - entry.low) * view.getUint16(2 * i, true)) / 65535;
  });
  return { ...entry, surface, traction: Float64Array.from(tractions, (level) => (level - 128) / 127) };
}

interface Scene {
  contact: Profiles;
  curve: Curve;
  grid: Grid;
}

export class Film {
  private readonly canvas: HTMLCanvasElement;
  private readonly slider: HTMLInputElement;
  private readonly button: HTMLButtonElement;
  private readonly words: HTMLElement;
  private readonly known = new Map<string, Promise<Profiles>>();
  private wanted?: string;
  private scene?: Scene;
  private units = DIMENSIONLESS;
  private timer?: number;
  /** The instant that the reader or the link has chosen; undefined at the pull-off and while it plays. */
  private chosen?: number;
  /** Whether `chosen` is meant for the contact that is shown next. */
  private sought = false;
  /** The first contact moves at once, unless the reader wants no motion. */
  private opening = !matchMedia("(prefers-reduced-motion: reduce)").matches;

  /** @param moved Is told the instant that is shown. */
  constructor(
    private readonly host: HTMLElement,
    private readonly moved: (time: number) => void,
  ) {
    this.canvas = host.querySelector("canvas")!;
    this.slider = host.querySelector("input")!;
    this.button = host.querySelector("button")!;
    this.words = host.querySelector("output")!;
    this.slider.addEventListener("input", () => this.choose());
    this.button.addEventListener("click", () => (this.timer === undefined ? this.play() : this.choose()));
    new ResizeObserver(() => this.draw()).observe(this.canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
  }

  /**
   * Show the contact of a curve, at its pull-off.
   *
   * @param grid The steps of the curve.
   * @param own Whether it is that of the protocol on the page, and not the nearest one.
   * @param units Of the numbers beside it.
   * @throws Trouble where it cannot be had.
   */
  async show(curve: Curve, grid: Grid, own: boolean, units: Units): Promise<void> {
    this.units = units;
    const { tabor, peak_indentation: peak, modulus_ratio: ratio } = curve.protocol;
    const about = `${title(curve)}, μ ${significant(tabor, 3)}, peak ${significant(peak, 3)}, k ${significant(ratio, 2)}`;
    const caption = own ? `The computed contact: ${about}` : `Not your protocol, but the nearest computed one: ${about}`;
    this.host.querySelector("figcaption span")!.textContent = caption;
    this.host.dataset["own"] = String(own);
    const sought = this.sought;
    this.sought = false;
    if (this.wanted === curve.name) return sought ? this.rest() : this.draw();
    this.wanted = curve.name;
    if (!sought) this.chosen = undefined;
    const loading = this.known.get(curve.name) ?? loadProfiles(curve.name);
    this.known.set(curve.name, loading);
    loading.catch(() => this.known.delete(curve.name));
    const contact = await loading;
    if (this.wanted !== curve.name) return;
    this.stop();
    this.scene = { contact, curve, grid };
    this.slider.max = String(contact.times.length - 1);
    this.rest();
    if (this.opening && this.chosen === undefined) {
      this.slider.value = "0";
      this.play();
    }
    this.opening = false;
    this.host.dataset["shown"] = curve.name;
  }

  /** The instant to restore, if it is not the usual one. */
  get instant(): number | undefined {
    return this.chosen;
  }

  /** Stand at an instant, or at the pull-off, of the contact that is shown next. */
  seek(instant: number | undefined): void {
    [this.chosen, this.sought] = [instant, true];
  }

  private choose(): void {
    this.stop();
    this.chosen = this.scene && this.time(this.scene);
    this.draw();
  }

  /** The instant that the slider is at. */
  private time({ contact: { times } }: Scene): number {
    return linearly(this.slider.valueAsNumber, [...times.keys()], times);
  }

  /** From here, or from the approach, to the release, and back to the pull-off. */
  private play(): void {
    this.chosen = undefined;
    if (Number(this.slider.value) >= Number(this.slider.max)) this.slider.value = "0";
    this.name("Pause");
    this.timer = window.setInterval(() => {
      if (this.slider.valueAsNumber < Number(this.slider.max)) {
        this.slider.valueAsNumber += STRIDE;
        return this.draw();
      }
      this.stop();
      this.rest();
    }, PAUSE);
  }

  /** Stand at the chosen instant, or at the pull-off. */
  private rest(): void {
    if (!this.scene) return;
    const { times } = this.scene.contact;
    const place =
      this.chosen === undefined
        ? nearest(times, this.scene.curve.results.pull_off_time)
        : linearly(this.chosen, times, [...times.keys()]);
    this.slider.value = String(place);
    this.draw();
  }

  private stop(): void {
    clearInterval(this.timer);
    this.timer = undefined;
    this.name("Play");
  }

  private name(action: "Play" | "Pause"): void {
    this.button.textContent = action === "Play" ? "▶" : "❚❚";
    this.button.setAttribute("aria-label", `${action} the contact`);
  }

  private draw(): void {
    if (!this.scene) return;
    const { curve, grid } = this.scene;
    const place = this.slider.valueAsNumber;
    const time = this.time(this.scene);
    const [depth, load] = [grid.indentations, curve.force].map((values) => linearly(time, grid.times, values)) as [number, number];
    const { units } = this;
    const quantities = [["t", time, units.time], ["δ", depth, units.length], ["P", load, units.force]] as const;
    const words = quantities.map(([symbol, value, scale]) => {
      const { size, name } = handy(scale, units.laboratory, value);
      return `${symbol} ${significant(value * size, 3)}${units.laboratory ? `\u00a0${name}` : ""}`;
    });
    const said = words.join(" · ");
    this.words.textContent = said;
    this.slider.setAttribute("aria-valuetext", said);
    this.canvas.setAttribute("aria-label", `Sphere and surface at ${said}`);
    this.paint(this.scene, place, depth);
    this.moved(time);
  }

  private paint({ contact, curve, grid }: Scene, place: number, depth: number): void {
    const { canvas } = this;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (width === 0 || height === 0) return;
    const scale = devicePixelRatio;
    [canvas.width, canvas.height] = [width * scale, height * scale];
    const pen = canvas.getContext("2d")!;
    pen.scale(scale, scale);
    const { nodes, reach, low, high } = contact;
    const bottom = low - 0.35 * (high - low + 1);
    const top = Math.max(high, 1 - grid.indentations[0]!) + 1.5;
    const across = (radius: number) => (0.5 + (0.5 * radius) / reach) * width;
    const up = (z: number) => ((top - z) / (top - bottom)) * height;
    const sphere = (radius: number) => 1 - depth + 0.5 * curve.protocol.tabor * radius ** 2;
    const [before, after] = [Math.floor(place), Math.min(Math.floor(place) + 1, contact.times.length - 1)];
    /** Between two recorded instants. */
    const of = (values: Float64Array, i: number) => {
      const [from, to] = [values[before * nodes + Math.abs(i)]!, values[after * nodes + Math.abs(i)]!];
      return from + (place - before) * (to - from);
    };
    const radius = (i: number) => (reach * i) / (nodes - 1);
    const all = Array.from({ length: 2 * nodes - 1 }, (_, i) => i - nodes + 1);
    const ink = colours();

    const fill = (points: number[][], end: number, colour: string) => {
      pen.beginPath();
      pen.moveTo(0, end);
      for (const [x, y] of points) pen.lineTo(x!, y!);
      pen.lineTo(width, end);
      pen.fillStyle = colour;
      pen.fill();
    };
    const outline = all.map((i) => [across(radius(i)), up(sphere(radius(i)))]);
    const surface = all.map((i) => [across(radius(i)), up(of(contact.surface, i))]);
    fill(outline, -height, ink.sphere);
    fill(surface, height, ink.solid);
    pen.lineCap = "round";
    pen.lineWidth = 4;
    for (let k = 1; k < surface.length; k++) {
      const mean = 0.5 * (of(contact.traction, all[k]!) + of(contact.traction, all[k - 1]!));
      pen.beginPath();
      pen.moveTo(surface[k - 1]![0]!, surface[k - 1]![1]!);
      pen.lineTo(surface[k]![0]!, surface[k]![1]!);
      // Weak tractions are to be seen, too.
      const share = Math.round(100 * Math.sqrt(Math.abs(mean)));
      pen.strokeStyle = `color-mix(in srgb, ${mean < 0 ? ink.push : ink.pull} ${share}%, ${ink.muted})`;
      pen.stroke();
    }
  }
}

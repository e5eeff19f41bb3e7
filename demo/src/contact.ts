/**
 * The contact itself, of a solver curve: sphere, surface, and traction as colour, on a canvas with a slider and a play
 * button. The profiles are written by `python -m experiments.demo_curves`, on equally spaced radii.
 *
 * Units: radius in β, heights in h0, traction in Δγ / h0, positive in tension.
 */

import { fetchFile } from "./files";
import { significant } from "./format";
import { linearly, type Grid } from "./protocol";
import { colours } from "./series";
import { Trouble } from "./trouble";

const FILE = "./contacts.json";
const PAUSE = 90;
const WHAT = "The profiles of the contact";

interface Entry {
  name: string;
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

export interface Profiles extends Omit<Entry, "surface" | "traction"> {
  nodes: number;
  surface: Float64Array;
  /** From -1, the strongest push, to 1, the strongest pull. */
  traction: Float64Array;
}

const bytes = (text: string) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));

/**
 * The contacts by the names of their curves.
 *
 * @throws Trouble where they cannot be had.
 */
export async function loadProfiles(): Promise<Map<string, Profiles>> {
  const content = new TextDecoder().decode(await fetchFile(FILE, WHAT));
  try {
    const { nodes, contacts } = JSON.parse(content) as { nodes: number; contacts: Entry[] };
    return new Map(contacts.map((entry) => [entry.name, unpacked(entry, nodes)]));
  } catch {
    throw new Trouble(`${WHAT} could not be read: ${FILE} is not what experiments.demo_curves writes.`);
  }
}

function unpacked(entry: Entry, nodes: number): Profiles {
  const [heights, tractions] = [bytes(entry.surface), bytes(entry.traction)];
  const size = nodes * entry.times.length;
  if (heights.length !== 2 * size || tractions.length !== size) throw new Error("cut");
  const view = new DataView(heights.buffer);
  const surface = Float64Array.from({ length: size }, (_, i) => {
    return entry.low + ((entry.high - entry.low) * view.getUint16(2 * i, true)) / 65535;
  });
  return { ...entry, nodes, surface, traction: Float64Array.from(tractions, (level) => (level - 128) / 127) };
}

/** What the film needs to know of the solver's curve. */
export interface Scene {
  contact: Profiles;
  tabor: number;
  grid: Grid;
  force: readonly number[];
  pullOffTime: number;
}

export class Film {
  private readonly canvas: HTMLCanvasElement;
  private readonly slider: HTMLInputElement;
  private readonly button: HTMLButtonElement;
  private readonly words: HTMLElement;
  private scene?: Scene;
  private timer?: number;

  /** @param moved Is told the place of what is shown between the measurement steps; undefined where there is none. */
  constructor(
    private readonly host: HTMLElement,
    private readonly moved: (step: number | undefined) => void,
  ) {
    this.canvas = host.querySelector("canvas")!;
    this.slider = host.querySelector("input")!;
    this.button = host.querySelector("button")!;
    this.words = host.querySelector("output")!;
    this.slider.addEventListener("input", () => {
      this.stop();
      this.draw();
    });
    this.button.addEventListener("click", () => (this.timer === undefined ? this.play() : this.stop()));
    new ResizeObserver(() => this.draw()).observe(this.canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
  }

  /** Show the contact of a curve, at its pull-off, or none. */
  show(scene: Scene | undefined): void {
    const same = scene && scene.contact === this.scene?.contact;
    this.scene = scene;
    this.host.hidden = !scene;
    if (!same) this.stop();
    if (scene && !same) {
      const away = scene.contact.times.map((time) => Math.abs(time - scene.pullOffTime));
      this.slider.max = String(away.length - 1);
      this.slider.value = String(away.indexOf(Math.min(...away)));
    }
    this.draw();
  }

  private play(): void {
    if (Number(this.slider.value) >= Number(this.slider.max)) this.slider.value = "0";
    this.name("Pause");
    this.timer = window.setInterval(() => {
      this.slider.valueAsNumber += 1;
      this.draw();
      if (this.slider.valueAsNumber >= Number(this.slider.max)) this.stop();
    }, PAUSE);
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
    if (!this.scene) return this.moved(undefined);
    const { contact, grid, force } = this.scene;
    const frame = this.slider.valueAsNumber;
    const time = contact.times[frame]!;
    const [depth, load] = [grid.indentations, force].map((values) => linearly(time, grid.times, values)) as [
      number,
      number,
    ];
    const said = [`t ${significant(time, 3)}`, `δ ${significant(depth, 3)}`, `P ${significant(load, 3)}`].join(" · ");
    this.words.textContent = said;
    this.slider.setAttribute("aria-valuetext", said);
    this.canvas.setAttribute("aria-label", `Sphere and surface at ${said}`);
    this.paint(this.scene, frame, depth);
    this.moved(linearly(time, grid.times, [...grid.times.keys()]));
  }

  private paint({ contact, tabor, grid }: Scene, frame: number, depth: number): void {
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
    const sphere = (radius: number) => 1 - depth + 0.5 * tabor * radius ** 2;
    const at = (i: number) => frame * nodes + Math.abs(i);
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
    const surface = all.map((i) => [across(radius(i)), up(contact.surface[at(i)]!)]);
    fill(outline, -height, ink.sphere);
    fill(surface, height, ink.solid);
    pen.lineCap = "round";
    pen.lineWidth = 4;
    for (let k = 1; k < surface.length; k++) {
      const mean = 0.5 * (contact.traction[at(all[k]!)]! + contact.traction[at(all[k - 1]!)]!);
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

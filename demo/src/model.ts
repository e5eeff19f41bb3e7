/**
 * A surrogate, run by ONNX Runtime Web in WebAssembly on one thread, so that the page needs no cross-origin isolation
 * and hence no server of its own. One of the paper's models knows one solid and equally spaced steps; a pretrained one
 * knows any standard linear solid, physical steps, and its own uncertainty.
 */

import * as ort from "onnxruntime-web/wasm";

import type { CurveSet } from "./curves";
import { fetchFile } from "./files";
import { hysteresis, pullOff, type PullOff } from "./measures";
import { readDescription, type Description } from "./model_file";
import { physicalGrid } from "./physical_steps";
import { measurementGrid, QUANTITIES, type Counts, type Grid, type Protocol, type Quantity } from "./protocol";
import { Trouble } from "./trouble";

const INPUTS = ["times", "indentations", "tabor", "edge"];
const OUTPUT = "force";
/** What files of pretrained models compute besides. */
const BAND = ["force_lower", "force_upper", "pull_off_interval"] as const;
const RESULTS = ["pull_off_force", "pull_off_time", "hysteresis"] as const;
/** Share of true values that the bands of these files contain. */
export const COVERAGE = 0.9;
// As in `surrogate/validity.py`: relative to the bound.
const RANGE_TOLERANCE = 1e-6;

/** Whether a positive quantity lies outside its training range, but for rounding. */
export function isOutside(value: number, low: number, high: number): boolean {
  return value < low * (1 - RANGE_TOLERANCE) || value > high * (1 + RANGE_TOLERANCE);
}

/** Where the solver's values are to be expected: at each step, and for the pull-off force. */
export interface Band {
  lower: Float64Array;
  upper: Float64Array;
  pullOff: readonly [number, number];
}

export interface Prediction {
  grid: Grid;
  force: Float64Array;
  pullOff: PullOff;
  hysteresis: number;
  /** Of a pretrained model; infinitely wide outside its training. */
  band?: Band;
  milliseconds: number;
}

export class Model {
  private idle: Promise<unknown> = Promise.resolve();

  private constructor(
    private readonly session: ort.InferenceSession,
    private readonly about: Description,
    private readonly counts: Counts,
  ) {}

  get name(): string {
    return this.about.name;
  }

  /** Smallest and largest value of each quantity in the training. */
  get ranges(): Description["ranges"] {
    return this.about.ranges;
  }

  /** Whether it knows any standard linear solid, and its uncertainty. */
  get banded(): boolean {
    return this.about.counts !== undefined;
  }

  /**
   * Fetch and compile a model.
   *
   * @param curves The solver curves: their measurement steps are the model's, and their solid that of one that knows one.
   * @throws Trouble: no such file, not one of our models, or nothing that runs.
   */
  static async load(url: string, runtime: string, curves: Promise<CurveSet>): Promise<Model> {
    const bytes = await fetchFile(url, "The model");
    const { counts, modulus_ratio: modulusRatio } = await curves;
    const about = readDescription(bytes, url, modulusRatio);
    if (about.counts && about.counts.join() !== counts.join()) {
      throw new Trouble(`${url} and the solver curves have different measurement steps; build the page again.`);
    }
    ort.env.wasm.numThreads = 1;
    ort.env.wasm.wasmPaths = { wasm: runtime };
    let session: ort.InferenceSession;
    try {
      session = await ort.InferenceSession.create(bytes, { executionProviders: ["wasm"] });
    } catch (error) {
      // ONNX Runtime fetches its WebAssembly itself, which lets the browser keep it compiled, but does not say why not.
      await fetchFile(runtime, "ONNX Runtime", { method: "HEAD" });
      console.error(error);
      throw new Trouble(
        `The model could not be started: ${runtime} or ${url} is damaged, or this browser is too old for them.`,
      );
    }
    const inputs = about.counts ? [...INPUTS, "modulus_ratio"] : INPUTS;
    const outputs = about.counts ? [OUTPUT, ...RESULTS, ...BAND] : [OUTPUT];
    const wanted = [...inputs, ...outputs].join(", ");
    const found = [...session.inputNames, ...session.outputNames].join(", ");
    const ours = [...session.inputNames].sort().join() === [...inputs].sort().join();
    if (!ours || !outputs.every((name) => session.outputNames.includes(name))) {
      throw new Trouble(`${url} is not a surrogate of this project: expected ${wanted}, received ${found}.`);
    }
    const model = new Model(session, about, counts);
    await model.warmUp();
    return model;
  }

  /** The steps at which a protocol is predicted. */
  grid(protocol: Protocol): Grid {
    return this.banded ? physicalGrid(this.dwelling(protocol), this.counts) : measurementGrid(protocol, this.counts);
  }

  /** Predict protocols, all in one run; calls wait for each other. */
  predict(protocols: readonly Protocol[]): Promise<Prediction[]> {
    const result = this.idle.then(() => this.run(protocols));
    this.idle = result.catch(() => undefined);
    return result;
  }

  /** The quantities of a protocol that lie outside the training ranges. */
  outside(protocol: Protocol): Quantity[] {
    return QUANTITIES.filter((name) => isOutside(protocol[name], ...this.ranges[name]));
  }

  /** A first run compiles what later ones only call. */
  private async warmUp(): Promise<void> {
    await this.predict([Object.fromEntries(QUANTITIES.map((name) => [name, this.ranges[name][0]])) as Protocol]);
  }

  /** The physical steps need a dwell: a shorter one than any of the training is computed as the shortest. */
  private dwelling(protocol: Protocol): Protocol {
    return { ...protocol, dwell_time: Math.max(protocol.dwell_time, this.ranges.dwell_time[0]) };
  }

  private async run(protocols: readonly Protocol[]): Promise<Prediction[]> {
    const grids = protocols.map((protocol) => this.grid(protocol));
    const batch = grids.length;
    const steps = grids[0]!.times.length;
    const stack = (part: "times" | "indentations" | "edge") => {
      const values = new Float64Array(batch * steps);
      grids.forEach((grid, row) => values.set(grid[part], row * steps));
      return new ort.Tensor("float64", values, [batch, steps]);
    };
    const each = (name: Quantity) => {
      const values = Float64Array.from(protocols, (protocol) => protocol[name]);
      return new ort.Tensor("float64", values, [batch]);
    };
    const feeds = {
      times: stack("times"),
      indentations: stack("indentations"),
      tabor: each("tabor"),
      edge: stack("edge"),
      ...(this.banded && { modulus_ratio: each("modulus_ratio") }),
    };
    const begin = performance.now();
    const outputs = await this.session.run(feeds);
    const milliseconds = performance.now() - begin;
    /** One row of an output. */
    const part = (name: string, row: number) => {
      const { data, dims } = outputs[name]!;
      const width = dims[1] ?? 1;
      return Float64Array.from((data as Float64Array | Float32Array).subarray(row * width, (row + 1) * width));
    };
    if (!(outputs[OUTPUT]!.data as Float64Array).every(Number.isFinite)) {
      throw new Trouble("These phases are too different in length for the measurement steps to be told apart.");
    }
    return protocols.map((protocol, row) => ({
      grid: grids[row]!,
      milliseconds,
      ...this.results(protocol, grids[row]!, (name) => part(name, row)),
    }));
  }

  private results(protocol: Protocol, grid: Grid, part: (name: string) => Float64Array) {
    const force = part(OUTPUT);
    const highest = pullOff(grid, force);
    if (!this.banded) return { force, pullOff: highest, hysteresis: hysteresis(grid, force) };
    const [top, time, area] = RESULTS.map((name) => part(name)[0]!) as [number, number, number];
    let [lower, upper, interval] = BAND.map(part) as [Float64Array, Float64Array, Float64Array];
    // Also where a dwell was too short, and the shortest one was computed.
    if (this.outside(protocol).length) {
      lower = lower.fill(-Infinity);
      upper = upper.fill(Infinity);
      interval = Float64Array.of(-Infinity, Infinity);
    }
    const band = { lower, upper, pullOff: [interval[0]!, interval[1]!] as const };
    return { force, pullOff: { ...highest, force: top, time }, hysteresis: area, band };
  }
}

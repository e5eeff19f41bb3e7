/**
 * The published surrogate, run by ONNX Runtime Web in WebAssembly on one thread, so that the page needs no
 * cross-origin isolation and hence no server of its own.
 */

import * as ort from "onnxruntime-web/wasm";

import { fetchFile } from "./files";
import { readMetadata } from "./onnx_metadata";
import { measurementGrid, QUANTITIES, type Grid, type Protocol, type Quantity } from "./protocol";
import { Trouble } from "./trouble";

const INPUTS = ["times", "indentations", "tabor", "edge"];
const OUTPUT = "force";
const FORMAT = "viscoelastic-contact-surrogate-onnx";
const FORMAT_VERSION = "1";
// As in `surrogate/extrapolation.py`: relative to the bound.
const RANGE_TOLERANCE = 1e-6;

/** Whether a positive quantity lies outside its training range, but for rounding. */
export function isOutside(value: number, low: number, high: number): boolean {
  return value < low * (1 - RANGE_TOLERANCE) || value > high * (1 + RANGE_TOLERANCE);
}


export type Ranges = Record<Quantity, readonly [number, number]>;

export interface Prediction {
  force: Float64Array;
  milliseconds: number;
}

export class Model {
  private idle: Promise<unknown> = Promise.resolve();

  private constructor(
    private readonly session: ort.InferenceSession,
    readonly name: string,
    readonly ranges: Ranges,
  ) {}

  /**
   * Fetch and compile the model.
   *
   * @throws Trouble: no such file, not one of our models, or nothing that runs.
   */
  static async load(url: string, runtime: string): Promise<Model> {
    const bytes = await fetchFile(url, "The model");
    const metadata = readMetadata(bytes);
    const ranges = parseRanges(metadata.get("ranges"));
    const foreign = `${url} is not a surrogate of this project`;
    if (metadata.get("format") !== FORMAT || !ranges) throw new Trouble(`${foreign}: its metadata do not say so.`);
    if (metadata.get("format_version") !== FORMAT_VERSION) {
      throw new Trouble(`${foreign}: expected version ${FORMAT_VERSION}, received ${metadata.get("format_version")}.`);
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
    const wanted = [...INPUTS, OUTPUT].join(", ");
    const found = [...session.inputNames, ...session.outputNames].join(", ");
    if ([...session.inputNames].sort().join() !== [...INPUTS].sort().join() || session.outputNames[0] !== OUTPUT) {
      throw new Trouble(`${foreign}: expected ${wanted}, received ${found}.`);
    }
    const model = new Model(session, metadata.get("name") ?? "surrogate", ranges);
    await model.warmUp();
    return model;
  }

  /** Predict the force along sampled protocols of equal length, all in one run; calls wait for each other. */
  predict(cases: readonly { protocol: Protocol; grid: Grid }[]): Promise<Prediction[]> {
    const result = this.idle.then(() => this.run(cases));
    this.idle = result.catch(() => undefined);
    return result;
  }

  /** A first run compiles what later ones only call. */
  private async warmUp(): Promise<void> {
    const protocol = Object.fromEntries(QUANTITIES.map((name) => [name, this.ranges[name][0]])) as Protocol;
    await this.predict([{ protocol, grid: measurementGrid(protocol, [2, 1, 1]) }]);
  }

  private async run(cases: readonly { protocol: Protocol; grid: Grid }[]): Promise<Prediction[]> {
    const batch = cases.length;
    const steps = cases[0]!.grid.times.length;
    const stack = (part: "times" | "indentations" | "edge") => {
      const values = new Float64Array(batch * steps);
      cases.forEach(({ grid }, row) => values.set(grid[part], row * steps));
      return new ort.Tensor("float64", values, [batch, steps]);
    };
    const tabor = Float64Array.from(cases, ({ protocol }) => protocol.tabor);
    const feeds = {
      times: stack("times"),
      indentations: stack("indentations"),
      tabor: new ort.Tensor("float64", tabor, [batch]),
      edge: stack("edge"),
    };
    const begin = performance.now();
    const { [OUTPUT]: output } = await this.session.run(feeds);
    const milliseconds = performance.now() - begin;
    const force = Float64Array.from(output!.data as Float64Array | Float32Array);
    if (!force.every(Number.isFinite)) {
      throw new Trouble("These phases are too different in length for the measurement steps to be told apart.");
    }
    return cases.map((_, row) => ({ force: force.slice(row * steps, (row + 1) * steps), milliseconds }));
  }

  /** The quantities of a protocol that lie outside the training ranges. */
  outside(protocol: Protocol): Quantity[] {
    return QUANTITIES.filter((name) => {
      const [low, high] = this.ranges[name];
      return isOutside(protocol[name], low, high);
    });
  }
}

function parseRanges(text: string | undefined): Ranges | undefined {
  try {
    const ranges = JSON.parse(text ?? "null") as Ranges | null;
    const complete = QUANTITIES.every((name) => ranges?.[name]?.length === 2 && ranges[name].every(Number.isFinite));
    return complete ? ranges! : undefined;
  } catch {
    return undefined;
  }
}

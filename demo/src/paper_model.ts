/**
 * The model of the paper, run by ONNX Runtime Web in WebAssembly on one thread, so that the page needs no cross-origin
 * isolation. Runtime, model and its solver curves are fetched when it is chosen.
 */

import type { InferenceSession } from "onnxruntime-web/wasm";

import type { CurveSet } from "./curves";
import { fetchFile } from "./files";
import { hysteresis, pullOff } from "./measures";
import type { Model, Prediction, Ranges } from "./model";
import { readMetadata } from "./onnx_metadata";
import { measurementGrid, QUANTITIES, type Counts, type Protocol } from "./protocol";
import { Trouble } from "./trouble";

const FILE = "./model.onnx";
const RUNTIME = "./ort.wasm";
const FORMAT = "viscoelastic-contact-surrogate-onnx";
const VERSION = "1";
const INPUTS = ["times", "indentations", "tabor", "edge"];

export class PaperModel implements Model {
  private idle: Promise<unknown> = Promise.resolve();

  private constructor(
    private readonly ort: typeof import("onnxruntime-web/wasm"),
    private readonly session: InferenceSession,
    private readonly counts: Counts,
    readonly name: string,
    readonly ranges: Ranges,
  ) {}

  /**
   * Fetch and compile the model.
   *
   * @param curves The solver curves: their measurement steps and their solid are the model's.
   * @throws Trouble: no such file, not one of our models, or nothing that runs.
   */
  static async load(curves: Promise<CurveSet>): Promise<PaperModel> {
    if (typeof WebAssembly === "undefined") {
      throw new Trouble("This browser runs no WebAssembly, which this model needs; switch it on, or use a current browser.");
    }
    const bytes = await fetchFile(FILE, "The model");
    const { counts, modulus_ratio: modulusRatio } = await curves;
    const { name, ranges } = readDescription(bytes, modulusRatio);
    const ort = await import("onnxruntime-web/wasm").catch(() => {
      throw new Trouble("ONNX Runtime could not be loaded (its script cannot be reached).");
    });
    ort.env.wasm.numThreads = 1;
    ort.env.wasm.wasmPaths = { wasm: RUNTIME };
    let session: InferenceSession;
    try {
      session = await ort.InferenceSession.create(bytes, { executionProviders: ["wasm"] });
    } catch (error) {
      // ONNX Runtime fetches its WebAssembly itself, which lets the browser keep it compiled, but does not say why not.
      await fetchFile(RUNTIME, "ONNX Runtime", { method: "HEAD" });
      console.error(error);
      throw new Trouble(
        `The model could not be started: ${RUNTIME} or ${FILE} is damaged, or this browser is too old for them.`,
      );
    }
    const found = [...session.inputNames].sort().join();
    if (found !== [...INPUTS].sort().join() || !session.outputNames.includes("force")) {
      throw new Trouble(`${FILE} is not a surrogate of this project: expected ${INPUTS.join(", ")}, received ${found}.`);
    }
    return new PaperModel(ort, session, counts, name, ranges);
  }

  /** Predict one protocol; calls wait for each other. */
  predict(protocol: Protocol): Promise<Prediction> {
    const result = this.idle.then(() => this.run(protocol));
    this.idle = result.catch(() => undefined);
    return result;
  }

  private async run(protocol: Protocol): Promise<Prediction> {
    const grid = measurementGrid(protocol, this.counts);
    const row = (values: Float64Array) => new this.ort.Tensor("float64", values, [1, values.length]);
    const outputs = await this.session.run({
      times: row(grid.times),
      indentations: row(grid.indentations),
      tabor: new this.ort.Tensor("float64", Float64Array.of(protocol.tabor), [1]),
      edge: row(grid.edge),
    });
    const force = Float64Array.from(outputs["force"]!.data as Float64Array);
    if (!force.every(Number.isFinite)) {
      throw new Trouble("These phases are too different in length for the measurement steps to be told apart.");
    }
    return { grid, force, pullOff: pullOff(grid, force), hysteresis: hysteresis(grid, force) };
  }
}

/** Name and ranges in the metadata of the file. */
function readDescription(bytes: Uint8Array, modulusRatio: number): { name: string; ranges: Ranges } {
  const metadata = readMetadata(bytes);
  const foreign = `${FILE} is not a surrogate of this project`;
  let ranges = { modulus_ratio: [modulusRatio, modulusRatio] } as unknown as Ranges;
  try {
    ranges = { ...ranges, ...(JSON.parse(metadata.get("ranges") ?? "{}") as Partial<Ranges>) };
  } catch {
    // Found incomplete below.
  }
  const complete = QUANTITIES.every((name) => ranges[name]?.length === 2 && ranges[name].every(Number.isFinite));
  if (metadata.get("format") !== FORMAT || !complete) throw new Trouble(`${foreign}: its metadata do not say so.`);
  if (metadata.get("format_version") !== VERSION) {
    throw new Trouble(`${foreign}: expected version ${VERSION}, received ${metadata.get("format_version")}.`);
  }
  return { name: metadata.get("name") ?? "surrogate", ranges };
}

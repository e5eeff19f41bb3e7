/** The models of the page, each with the solver curves on its own measurement steps; loaded when they are asked for. */

import { loadCurves, type CurveSet } from "./curves";
import { Model } from "./model";

const RUNTIME = "./ort.wasm";

export interface Loaded {
  model: Model;
  set: CurveSet;
}

export class Shelf {
  private readonly pretrained = new Map<string, Promise<Loaded>>();
  private solids?: Promise<CurveSet>;

  private constructor(readonly paper: Loaded) {}

  /**
   * Load the model of the paper.
   *
   * @throws Trouble where it, or its curves, cannot be had.
   */
  static async open(): Promise<Shelf> {
    const curves = loadCurves("./curves.json");
    const [model, set] = await Promise.all([Model.load("./model.onnx", RUNTIME, curves), curves]);
    return new Shelf({ model, set });
  }

  /**
   * A model by its name in links; the paper's without one.
   *
   * @throws Trouble where it cannot be had; asked again, it is tried again.
   */
  get(name?: string): Promise<Loaded> {
    if (name === undefined) return Promise.resolve(this.paper);
    const known = this.pretrained.get(name);
    if (known) return known;
    const loading = this.load(name);
    this.pretrained.set(name, loading);
    loading.catch(() => this.pretrained.delete(name));
    return loading;
  }

  private async load(name: string): Promise<Loaded> {
    this.solids ??= loadCurves("./solids.json");
    const curves = this.solids;
    curves.catch(() => (this.solids = undefined));
    const [model, set] = await Promise.all([Model.load(`./${name}.onnx`, RUNTIME, curves), curves]);
    return { model, set };
  }
}

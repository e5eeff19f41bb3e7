/** The models of the page, each with the solver curves on its own measurement steps; loaded when they are asked for. */

import { loadCurves, type CurveSet } from "./curves";
import { Fast } from "./fast";
import type { Model } from "./model";
import { PaperModel } from "./paper_model";

/** Names in links, the usual one first. */
export const MODELS = ["fast", "M1-concat"] as const;
export type Name = (typeof MODELS)[number];

export interface Loaded {
  model: Model;
  set: CurveSet;
}

export class Shelf {
  private readonly known = new Map<Name, Promise<Loaded>>();

  /** @param solids The curves of any solid, which the page shows before any model. */
  constructor(readonly solids: CurveSet) {}

  /**
   * A model by its name.
   *
   * @throws Trouble where it cannot be had; asked again, it is tried again.
   */
  get(name: Name): Promise<Loaded> {
    const known = this.known.get(name);
    if (known) return known;
    const loading = name === "fast" ? this.fast() : this.paper();
    this.known.set(name, loading);
    loading.catch(() => this.known.delete(name));
    return loading;
  }

  private async fast(): Promise<Loaded> {
    return { model: await Fast.load(), set: this.solids };
  }

  private async paper(): Promise<Loaded> {
    const curves = loadCurves("./curves.json");
    const [model, set] = await Promise.all([PaperModel.load(curves), curves]);
    return { model, set };
  }
}

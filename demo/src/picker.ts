/** The list of published protocols, and the buttons that go through them. */

import { curveOf, number, type Curve } from "./curves";
import { significant } from "./format";
import type { Protocol } from "./protocol";

const GROUPS: Record<Curve["kind"], string> = {
  paper: "The paper’s representative samples",
  test: "Test trajectories of the data set",
  solid: "Other solids",
};

export class Picker {
  private readonly list = document.getElementById("presets") as HTMLSelectElement;
  private curves: readonly Curve[] = [];

  /**
   * @param current What the page shows.
   * @param choose Shows another one.
   */
  constructor(
    private readonly current: () => Protocol,
    private readonly choose: (curve: Curve) => void,
  ) {
    this.list.addEventListener("change", () => {
      const curve = this.curves.find((candidate) => candidate.name === this.list.value);
      if (curve) this.choose(curve);
    });
    for (const [id, direction] of [
      ["previous", -1],
      ["next", 1],
    ] as const) {
      document.getElementById(id)!.addEventListener("click", () => this.turn(direction));
    }
  }

  fill(curves: readonly Curve[]): void {
    this.curves = curves;
    const kinds = Object.keys(GROUPS) as Curve["kind"][];
    const groups = kinds.map((kind) => {
      const element = document.createElement("optgroup");
      element.label = GROUPS[kind];
      for (const curve of curves.filter((candidate) => candidate.kind === kind)) {
        const { tabor, peak_indentation, modulus_ratio } = curve.protocol;
        const solid = kind === "solid" ? `, k ${significant(modulus_ratio, 2)}` : "";
        const text = `${number(curve)}: μ ${significant(tabor, 3)}, δₗ ${significant(peak_indentation, 3)}${solid}`;
        element.append(new Option(text, curve.name));
      }
      return element;
    });
    const own = new Option("your own", "");
    this.list.replaceChildren(own, ...groups.filter((group) => group.childElementCount > 0));
  }

  mark(curve: Curve | undefined): void {
    this.list.value = curve?.name ?? "";
  }

  private turn(direction: number): void {
    const { curves } = this;
    const at = curves.findIndex((curve) => curve === curveOf(curves, this.current()));
    const next = at < 0 ? (direction > 0 ? 0 : curves.length - 1) : (at + direction + curves.length) % curves.length;
    this.choose(curves[next]!);
  }
}

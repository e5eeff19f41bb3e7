/** One slider and one number box for each quantity, kept in step; the slider moves in the logarithm. */

import { significant } from "./format";
import { isOutside, type Ranges } from "./model";
import { complaint, LABELS, QUANTITIES, type Protocol, type Quantity } from "./protocol";

const NOTCHES = 400;
// The slider reaches beyond the training range by this share of its logarithm, on both sides.
const MARGIN = 0.12;
// The modulus ratio has no margin: none lies above one, and its slider keeps its ends where a model knows one ratio only.
const RATIOS = [0.01, 1] as const;
const SLIDER_DIGITS = 3;
const BOX_DIGITS = 6;

interface Field {
  row: HTMLElement;
  slider: HTMLInputElement;
  box: HTMLInputElement;
  note: HTMLElement;
  hint: HTMLElement;
  low: number;
  high: number;
}

export class Controls {
  private readonly fields = new Map<Quantity, Field>();
  private protocol: Protocol;

  constructor(
    host: HTMLElement,
    private ranges: Ranges,
    initial: Protocol,
    private readonly changed: (protocol: Protocol) => void,
  ) {
    this.protocol = { ...initial };
    for (const quantity of QUANTITIES) this.fields.set(quantity, this.build(host, quantity));
    this.suit(ranges, "");
    this.show(initial);
  }

  /** Take the ranges of another model; `fixed` says why a quantity of one value cannot be changed. */
  suit(ranges: Ranges, fixed: string): void {
    this.ranges = ranges;
    for (const [quantity, field] of this.fields) {
      const [from, to] = ranges[quantity];
      const one = from === to;
      const [low, high] = quantity === "modulus_ratio" ? RATIOS : [from, to];
      const margin = quantity === "modulus_ratio" ? 0 : MARGIN;
      const reach = Math.pow(high / low, margin);
      Object.assign(field, { low: low / reach, high: high * reach });
      field.slider.style.setProperty("--from", String(margin / (1 + 2 * margin)));
      field.slider.disabled = field.box.disabled = one;
      field.row.classList.toggle("fixed", one);
      field.hint.textContent = one ? fixed : "";
    }
  }

  /** Show a protocol without announcing it. */
  show(protocol: Protocol): void {
    this.protocol = { ...protocol };
    for (const quantity of QUANTITIES) {
      this.fields.get(quantity)!.box.value = String(Number(protocol[quantity].toPrecision(BOX_DIGITS)));
      this.place(quantity);
    }
  }

  private build(host: HTMLElement, quantity: Quantity): Field {
    const { name, symbol, unit } = LABELS[quantity];
    const row = document.createElement("div");
    row.className = "field";
    row.innerHTML = `
      <label for="${quantity}"><span>${name}</span> <i>${symbol.replace(/_(.)/, "<sub>$1</sub>")}</i></label>
      <span class="amount"><input type="number" id="${quantity}" step="any" inputmode="decimal"
        aria-describedby="${quantity}-note"><span class="unit">${unit}</span></span>
      <input type="range" id="${quantity}-slider" min="0" max="${NOTCHES}" step="1" aria-label="${name}"
        aria-describedby="${quantity}-note">
      <p class="note" id="${quantity}-note" role="status"></p><p class="hint"></p>`;
    host.append(row);
    const slider = row.querySelector<HTMLInputElement>("[type=range]")!;
    const box = row.querySelector<HTMLInputElement>("[type=number]")!;
    slider.addEventListener("input", () => this.slid(quantity));
    box.addEventListener("input", () => this.typed(quantity));
    const [note, hint] = [row.querySelector<HTMLElement>(".note")!, row.querySelector<HTMLElement>(".hint")!];
    return { row, slider, box, note, hint, low: 1, high: 1 };
  }

  private slid(quantity: Quantity): void {
    const { slider, box, low, high } = this.fields.get(quantity)!;
    const value = low * Math.pow(high / low, Number(slider.value) / NOTCHES);
    this.protocol[quantity] = Number(value.toPrecision(SLIDER_DIGITS));
    box.value = String(this.protocol[quantity]);
    this.place(quantity, true);
    this.changed({ ...this.protocol });
  }

  private typed(quantity: Quantity): void {
    const { box, row, note } = this.fields.get(quantity)!;
    const value = box.value.trim() === "" ? NaN : Number(box.value);
    const wrong = complaint(value, quantity);
    box.setAttribute("aria-invalid", String(Boolean(wrong)));
    if (wrong) {
      row.classList.add("outside");
      note.textContent = wrong;
      return;
    }
    this.protocol[quantity] = value;
    this.place(quantity);
    this.changed({ ...this.protocol });
  }

  /** Bring slider and note of a quantity in line with its value. */
  private place(quantity: Quantity, keepSlider = false): void {
    const { slider, box, row, note, low, high } = this.fields.get(quantity)!;
    const value = this.protocol[quantity];
    if (!keepSlider) slider.value = String(Math.round((NOTCHES * Math.log(value / low)) / Math.log(high / low)));
    const { name, unit } = LABELS[quantity];
    slider.setAttribute("aria-valuetext", `${name} ${significant(value, SLIDER_DIGITS)} ${unit}`.trim());
    box.removeAttribute("aria-invalid");
    const [from, to] = this.ranges[quantity];
    const outside = isOutside(value, from, to);
    row.classList.toggle("outside", outside);
    note.textContent = outside
      ? `Outside the training range, ${significant(from, SLIDER_DIGITS)} to ${significant(to, SLIDER_DIGITS)}.`
      : "";
  }
}

/** The corners of the protocol as handles, moved with pointer or keys: instants sideways, the peak up and down. */

import type { TimeScale } from "./axes";
import type { Chart } from "./chart";
import { significant } from "./format";
import { isOutside, type Ranges } from "./model";
import { corners, LABELS, startIndentation, type Protocol, type Quantity } from "./protocol";

const DIGITS = 3;
/** Factors of an arrow and of Page Up or Down. */
const STEP = 1.05;
const LEAP = 1.5;

interface Corner {
  /** Its number in the protocol. */
  at: 1 | 2 | 3;
  name: string;
  sideways: Quantity;
  lifts: boolean;
}
const CORNERS: readonly Corner[] = [
  { at: 1, name: "End of loading", sideways: "loading_rate", lifts: true },
  { at: 2, name: "End of the dwell", sideways: "dwell_time", lifts: true },
  { at: 3, name: "End of unloading", sideways: "unloading_rate", lifts: false },
];

export class Corners {
  private readonly handles: HTMLElement[];
  private dragged?: TimeScale;
  private protocol!: Protocol;
  private scale!: TimeScale;
  ranges?: Ranges;

  /** @param current What the page was asked for last, which may be ahead of what is drawn. */
  constructor(
    private readonly chart: Chart,
    private readonly current: () => Protocol,
    private readonly changed: (protocol: Protocol) => void,
    private readonly released: () => void,
  ) {
    this.handles = CORNERS.map((corner) => this.build(corner));
  }

  /** The scale of time that stays while a corner is dragged. */
  get held(): TimeScale | undefined {
    return this.dragged;
  }

  /** Take what is drawn. */
  take(protocol: Protocol, scale: TimeScale): void {
    [this.protocol, this.scale] = [protocol, scale];
    for (const [i, { at, sideways, lifts }] of CORNERS.entries()) {
      const said = [sideways, ...(lifts ? (["peak_indentation"] as const) : [])];
      const words = said.map((name) => `${LABELS[name].name} ${significant(protocol[name], DIGITS)}`).join(", ");
      const handle = this.handles[i]!;
      handle.setAttribute("aria-valuetext", words);
      handle.setAttribute("aria-valuenow", String(corners(protocol).times[at]));
    }
  }

  /** Put the handles where the corners are drawn. */
  place(): void {
    if (!this.protocol) return;
    const { indentations } = corners(this.protocol);
    for (const [i, { at }] of CORNERS.entries()) {
      const [x, y] = this.chart.pixel([this.scale.places[at]!, indentations[at]!]);
      Object.assign(this.handles[i]!.style, { left: `${x}px`, top: `${y}px` });
    }
  }

  private build(corner: Corner): HTMLElement {
    const handle = document.createElement("div");
    handle.className = "corner";
    handle.tabIndex = 0;
    handle.id = `corner-${corner.at}`;
    handle.setAttribute("role", "slider");
    handle.setAttribute("aria-label", corner.name);
    handle.setAttribute("aria-valuemin", "0");
    handle.setAttribute("aria-orientation", "horizontal");
    handle.addEventListener("pointerdown", (event) => {
      handle.setPointerCapture(event.pointerId);
      this.dragged = this.scale;
      handle.focus();
      event.preventDefault();
    });
    handle.addEventListener("pointermove", ({ clientX, clientY }) => {
      if (this.dragged) this.drag(corner, ...this.chart.point(clientX, clientY));
    });
    for (const end of ["pointerup", "pointercancel"]) {
      handle.addEventListener(end, () => {
        this.dragged = undefined;
        this.released();
      });
    }
    handle.addEventListener("keydown", (event) => this.key(corner, event));
    this.chart.host.append(handle);
    return handle;
  }

  private drag(corner: Corner, place: number, level: number): void {
    const next = { ...this.current() };
    const scale = this.dragged!;
    if (corner.lifts) next.peak_indentation = level;
    this.keep(next, "peak_indentation");
    const { times } = corners(next);
    // The phases before this one end where they are drawn.
    let begin = 0;
    for (let i = 1; i < corner.at; i++) begin += scale.width(times[i]! - times[i - 1]!);
    this.last(next, corner, scale.duration(Math.max(place - begin, 1e-9)));
  }

  /** Give the phase that ends at a corner a duration. */
  private last(next: Protocol, { sideways }: Corner, duration: number): void {
    const travel = next.peak_indentation - startIndentation(next.tabor);
    next[sideways] = sideways === "dwell_time" ? duration : travel / duration;
    this.keep(next, sideways);
    this.changed(next);
  }

  private key(corner: Corner, event: KeyboardEvent): void {
    const sideways: Record<string, number> = { ArrowRight: STEP, ArrowLeft: 1 / STEP, PageUp: LEAP, PageDown: 1 / LEAP };
    const upwards: Record<string, number> = corner.lifts ? { ArrowUp: STEP, ArrowDown: 1 / STEP } : {};
    const next = { ...this.current() };
    if (event.key in sideways) {
      const { times } = corners(next);
      this.last(next, corner, (times[corner.at]! - times[corner.at - 1]!) * sideways[event.key]!);
    } else if (event.key in upwards) {
      next.peak_indentation *= upwards[event.key]!;
      this.keep(next, "peak_indentation");
      this.changed(next);
    } else return;
    event.preventDefault();
  }

  /** Within the training, with a few digits. */
  private keep(protocol: Protocol, name: Quantity): void {
    const value = protocol[name];
    const [low, high] = this.ranges?.[name] ?? [0.001, 1000];
    const kept = Math.min(Math.max(value, low), high);
    protocol[name] = isOutside(value, low, high) ? kept : Number(kept.toPrecision(DIGITS));
  }
}

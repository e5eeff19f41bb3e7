/** Axes of the charts: real or stretched time, linear or signed logarithmic force. */

import { significant } from "./format";
import type { Grid } from "./protocol";

export const VIEWS = {
  /** `steps`: each phase as wide as its number of measurement steps; `real`: true to scale. */
  time: ["steps", "real"],
  force: ["linear", "log"],
  units: ["dimensionless", "laboratory"],
} as const;
export type View = { [axis in keyof typeof VIEWS]: (typeof VIEWS)[axis][number] };
export const USUAL_VIEW: View = { time: "steps", force: "linear", units: "dimensionless" };

export interface AxisStyle {
  line: string;
  muted: string;
}

/** sign(x) log10(1 + |x|): linear near zero, logarithmic far from it. */
export function toSignedLog(value: number): number {
  return Math.sign(value) * Math.log10(1 + Math.abs(value));
}

/** Zero and powers of ten up to the first beyond the data, on each side where there is data, as numbers of the axis. */
export function signedLogTicks(values: readonly number[]): { places: number[]; labels: string[] } {
  const [low, high] = [Math.min(...values), Math.max(...values)];
  const decades = (reach: number) => {
    const ticks = [];
    for (let tick = 1; reach > 0 && ticks.length < 8; tick *= 10) {
      ticks.push(tick);
      if (tick >= reach) break;
    }
    return ticks;
  };
  const ticks = [
    ...decades(-low)
      .map((tick) => -tick)
      .reverse(),
    0,
    ...decades(high),
  ];
  return { places: ticks.map(toSignedLog), labels: ticks.map((tick) => significant(tick)) };
}

export function valueAxis(name: string, style: AxisStyle, ticks?: { places: number[]; labels: string[] }) {
  const label = { color: style.muted, fontSize: 11.5 };
  const base = {
    type: "value",
    name,
    nameTextStyle: { color: style.muted, fontSize: 12 },
    scale: true,
    axisLine: { show: true, onZero: false, lineStyle: { color: style.line } },
    axisTick: { show: true, lineStyle: { color: style.line } },
    splitLine: { show: true, lineStyle: { color: style.line, opacity: 0.6 } },
    axisLabel: { ...label, formatter: (value: number) => significant(value, 6), hideOverlap: true },
  };
  if (!ticks) return base;
  const { places, labels } = ticks;
  const nearest = (value: number) => labels[places.findIndex((place) => Math.abs(place - value) < 1e-9)] ?? "";
  return {
    ...base,
    min: places[0],
    max: places.at(-1),
    axisTick: { ...base.axisTick, customValues: places },
    splitLine: { ...base.splitLine, customValues: places },
    axisLabel: { ...label, customValues: places, formatter: nearest },
  };
}

export function timeAxis(grid: Grid, view: View, style: AxisStyle, unit: string) {
  const stretched = view.time === "steps";
  const last = grid.ends[2];
  const corners = [0, ...grid.ends];
  const base = valueAxis("", style);
  const axis = {
    ...base,
    name: unit && (stretched ? `time / ${unit}, each phase stretched` : `time / ${unit}`),
    nameLocation: "middle",
    nameGap: 26,
    min: 0,
    max: stretched ? last : grid.times[last],
    splitLine: { show: false },
  };
  if (!stretched) return { ...axis, axisLabel: { ...base.axisLabel, showMaxLabel: false } };
  return {
    ...axis,
    axisTick: { ...base.axisTick, customValues: corners },
    axisLabel: {
      ...base.axisLabel,
      customValues: corners,
      formatter: (step: number) => significant(grid.times[Math.round(step)] ?? NaN, 3),
      alignMaxLabel: "right",
    },
  };
}

/** Shade the dwell and name the phases. */
export function phaseBands(grid: Grid, instant: (step: number) => number, band: string, text: string) {
  const [onset, end, last] = grid.ends;
  const total = instant(last);
  const phase = (name: string, from: number, to: number, shaded: boolean) => {
    const wide = instant(to) - instant(from) > 0.12 * total;
    return [
      {
        xAxis: instant(from),
        itemStyle: { color: shaded ? band : "transparent" },
        label: { show: wide, formatter: name, position: "insideBottom", color: text, fontSize: 11 },
      },
      { xAxis: instant(to) },
    ];
  };
  return {
    silent: true,
    data: [phase("loading", 0, onset, false), phase("dwell", onset, end, true), phase("unloading", end, last, false)],
  };
}

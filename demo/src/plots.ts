/** The three charts: protocol, force history, force-indentation loop. Drawn by ECharts. */

import { LineChart, ScatterChart } from "echarts/charts";
import {
  GridComponent,
  LegendComponent,
  MarkAreaComponent,
  TitleComponent,
  TooltipComponent,
} from "echarts/components";
import * as echarts from "echarts/core";
import { CanvasRenderer } from "echarts/renderers";

import { phaseBands, signedLogTicks, timeAxis, toSignedLog, valueAxis, type View } from "./axes";
import { significant } from "./format";
import type { PullOff } from "./measures";
import type { Grid } from "./protocol";

echarts.use([
  LineChart,
  ScatterChart,
  GridComponent,
  LegendComponent,
  MarkAreaComponent,
  TitleComponent,
  TooltipComponent,
  CanvasRenderer,
]);

export interface Picture {
  grid: Grid;
  force: Float64Array;
  pullOff: PullOff;
  /** The solver's force on the same steps, where there is one. */
  solver?: readonly number[];
  extrapolated: boolean;
  caption: string;
  /** The units of the numbers above. */
  names: { length: string; time: string; force: string };
}

const GROUP = "contact";
// A bare line for the solver; without an icon, ECharts puts a dot on it.
const LEGEND = [{ name: "solver", icon: "path://M0 0h22v2.5h-22z" }, { name: "surrogate" }, { name: "pull-off" }];
const PLACES = ["protocol", "history", "loop"] as const;
type Place = (typeof PLACES)[number];
const bracketed = (name: string) => (name.includes(" ") ? `(${name})` : name);
const TITLES: Record<Place, (names: Picture["names"]) => string> = {
  protocol: ({ length }) => `Protocol: indentation δ / ${length}`,
  history: ({ force }) => `Force P / ${bracketed(force)}, tension positive`,
  loop: () => "Loop: force against indentation",
};

export class Plots {
  private readonly charts: Record<Place, echarts.ECharts>;
  private readonly hosts: Record<Place, HTMLElement>;
  private last?: [Picture, View];

  constructor(hosts: Record<Place, HTMLElement>) {
    this.hosts = hosts;
    const start = (place: Place) => {
      const chart = echarts.init(hosts[place], null, { renderer: "canvas" });
      chart.group = GROUP;
      new ResizeObserver(() => {
        chart.resize();
        // The caption breaks where the chart's width wants it.
        if (place === "loop") this.redraw();
      }).observe(hosts[place]);
      return chart;
    };
    this.charts = { protocol: start("protocol"), history: start("history"), loop: start("loop") };
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.redraw());
  }

  private redraw(): void {
    if (this.last) this.draw(...this.last);
  }

  draw(picture: Picture, view: View): void {
    this.last = [picture, view];
    const ink = colours();
    const { grid, force, solver, pullOff } = picture;
    const signed = view.force === "log";
    const height = (value: number) => (signed ? toSignedLog(value) : value);
    const instant = (step: number) => (view.time === "steps" ? step : grid.times[step]!);
    const steps = [...grid.times.keys()];
    const along = (values: ArrayLike<number>) => steps.map((i) => [instant(i), height(values[i]!)]);
    const around = (values: ArrayLike<number>) => steps.map((i) => [grid.indentations[i]!, height(values[i]!)]);
    const ticks = signed ? signedLogTicks([...force, ...(solver ?? [])]) : undefined;

    const surrogate = (data: number[][], colour = picture.extrapolated ? ink.warn : ink.surrogate) => ({
      type: "line",
      name: "surrogate",
      data,
      symbol: "circle",
      symbolSize: 4.5,
      showSymbol: true,
      lineStyle: { width: 1.6, type: picture.extrapolated ? "dashed" : "solid" },
      color: colour,
      emphasis: { disabled: true },
      z: 3,
    });
    const reference = (data: number[][]) => ({
      type: "line",
      name: "solver",
      data,
      symbol: "none",
      lineStyle: { width: 2.4 },
      color: ink.solver,
      emphasis: { disabled: true },
      z: 2,
    });
    const peak = (x: number) => ({
      type: "scatter",
      name: "pull-off",
      data: [[x, height(pullOff.force)]],
      symbol: "diamond",
      symbolSize: 13,
      color: ink.peak,
      z: 4,
      emphasis: { disabled: true },
    });
    const both = (path: (values: ArrayLike<number>) => number[][], x: number) => [
      ...(solver ? [reference(path(solver))] : []),
      surrogate(path(force)),
      peak(x),
    ];
    const bands = phaseBands(grid, instant, ink.band, ink.muted);
    const tooltip = (params: unknown) => this.describe(params, picture);

    const frame = (place: Place, series: object[], x: object, y: object) => {
      this.charts[place].setOption(
        {
          animation: false,
          backgroundColor: ink.paper,
          textStyle: { fontFamily: ink.font },
          title: {
            text: TITLES[place](picture.names),
            subtext: place === "loop" ? picture.caption : "",
            left: 8,
            top: 6,
            itemGap: 6,
            textStyle: { fontSize: 13, lineHeight: 18, fontWeight: 600, color: ink.text },
            subtextStyle: {
              fontSize: 11.5,
              lineHeight: 15,
              color: ink.muted,
              width: this.hosts[place].clientWidth - 20,
              overflow: "break",
            },
          },
          legend:
            place === "protocol"
              ? { show: false }
              : {
                  bottom: 4,
                  left: "center",
                  itemWidth: 22,
                  data: LEGEND,
                  textStyle: { color: ink.text, fontSize: 12 },
                  selectedMode: false,
                },
          grid: {
            // The same left edge for both, so that their phases line up.
            left: 58,
            right: 22,
            top: place === "loop" ? 72 : 40,
            bottom: place === "protocol" ? 26 : 66,
            outerBoundsMode: "none",
          },
          tooltip: {
            trigger: "axis",
            confine: true,
            axisPointer: { type: "line", snap: true },
            backgroundColor: ink.paper,
            borderColor: ink.line,
            textStyle: { color: ink.text, fontSize: 12 },
            formatter: tooltip,
            ...(place === "loop" ? { trigger: "item" } : {}),
          },
          xAxis: x,
          yAxis: y,
          series,
        },
        { notMerge: true },
      );
    };
    const style = { line: ink.line, muted: ink.muted };
    const time = (unit: string) => timeAxis(grid, view, style, unit);
    const path = {
      ...surrogate(
        steps.map((i) => [instant(i), grid.indentations[i]!]),
        ink.path,
      ),
      markArea: bands,
    };
    path.lineStyle = { width: 2, type: "solid" };
    frame("protocol", [{ ...path, showSymbol: false }], time(""), valueAxis("", style));
    const [first, ...others] = both(along, instant(pullOff.step));
    frame("history", [{ ...first, markArea: bands }, ...others], time(picture.names.time), valueAxis("", style, ticks));
    const depth = {
      ...valueAxis(`indentation δ / ${picture.names.length}`, style),
      nameLocation: "middle",
      nameGap: 26,
      splitLine: { show: false },
    };
    frame("loop", both(around, grid.indentations[pullOff.step]!), depth, valueAxis("", style, ticks));
    this.label(picture);
  }

  /** All charts in one picture, as a PNG in a data URL. */
  png(): string {
    echarts.connect(GROUP);
    const url = this.charts.loop.getConnectedDataURL({ type: "png", pixelRatio: 2, backgroundColor: colours().paper });
    echarts.disconnect(GROUP);
    return url;
  }

  private describe(params: unknown, { grid, force, solver, pullOff }: Picture): string {
    const points = [params].flat() as { dataIndex: number; seriesName: string }[];
    const i = points.find((point) => point.seriesName !== "pull-off")?.dataIndex ?? pullOff.step;
    const lines = [`time ${significant(grid.times[i]!, 4)}`, `indentation ${significant(grid.indentations[i]!, 4)}`];
    lines.push(`surrogate ${significant(force[i]!, 4)}`);
    if (solver) lines.push(`solver ${significant(solver[i]!, 4)}`);
    return lines.join("<br>");
  }

  private label({ grid, pullOff, caption }: Picture): void {
    const [duration, peak] = [grid.times[grid.ends[2]]!, grid.indentations[grid.ends[0]]!].map((v) =>
      significant(v, 4),
    );
    const top = `pull-off force ${significant(pullOff.force, 4)} at time ${significant(pullOff.time, 4)}`;
    const say = (place: Place, text: string) => this.hosts[place].setAttribute("aria-label", text);
    say("protocol", `Indentation against time: up to ${peak}, held, and back, in a time of ${duration}.`);
    say("history", `Force against time: ${top}.`);
    say("loop", `Force against indentation for ${caption}: ${top}.`);
  }
}

/** Colours come from the style sheet, which knows about dark mode. */
function colours() {
  const style = getComputedStyle(document.documentElement);
  const of = (name: string) => style.getPropertyValue(`--${name}`).trim();
  return {
    paper: of("surface"),
    text: of("text"),
    muted: of("muted"),
    line: of("line"),
    band: of("band"),
    surrogate: of("accent"),
    solver: of("solver"),
    peak: of("peak"),
    warn: of("warn"),
    path: of("path"),
    font: getComputedStyle(document.body).fontFamily,
  };
}

/** The charts: protocol, force history, force-indentation loop, difference from the solver. Drawn by ECharts. */

import { CustomChart, LineChart, ScatterChart } from "echarts/charts";
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
import { linearly } from "./protocol";
import { bandArea, colours, pullOffMarks, residuals, solverLine, surrogateLine, type Picture } from "./series";

echarts.use([
  CustomChart,
  LineChart,
  ScatterChart,
  GridComponent,
  LegendComponent,
  MarkAreaComponent,
  TitleComponent,
  TooltipComponent,
  CanvasRenderer,
]);

const GROUP = "contact";
// A bare line for the solver; without an icon, ECharts puts a dot on it.
const LEGEND = [
  { name: "solver", icon: "path://M0 0h22v2.5h-22z" },
  { name: "surrogate" },
  { name: "90 % band", icon: "rect" },
  { name: "pull-off", icon: "diamond" },
];
type Place = "protocol" | "history" | "loop" | "residual";
const bracketed = (name: string) => (name.includes(" ") ? `(${name})` : name);
const TITLES: Record<Place, (names: Picture["names"]) => string> = {
  protocol: ({ length }) => `Protocol: indentation δ / ${length}`,
  history: ({ force }) => `Force P / ${bracketed(force)}, tension positive`,
  loop: () => "Loop: force against indentation",
  residual: ({ force }) => `Surrogate minus solver: ΔP / ${bracketed(force)}`,
};

export class Plots {
  private readonly charts = new Map<Place, echarts.ECharts>();
  private last?: [Picture, View];
  private instant?: number;

  constructor(private readonly hosts: Record<Place, HTMLElement>) {
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.redraw());
  }

  /** A chart, made when it is first drawn: ECharts wants its host in sight. */
  private chart(place: Place): echarts.ECharts {
    const known = this.charts.get(place);
    if (known) return known;
    const chart = echarts.init(this.hosts[place], null, { renderer: "canvas" });
    this.charts.set(place, chart);
    new ResizeObserver(() => {
      if (this.hosts[place].hidden) return;
      chart.resize();
      // The caption breaks where the chart's width wants it.
      if (place === "loop") this.redraw();
    }).observe(this.hosts[place]);
    return chart;
  }

  private redraw(): void {
    if (this.last) this.draw(...this.last);
  }

  draw(picture: Picture, view: View): void {
    this.last = [picture, view];
    const ink = colours();
    const { grid, force, solver, pullOff, band } = picture;
    const signed = view.force === "log";
    const height = (value: number) => (signed ? toSignedLog(value) : value);
    const instant = (step: number) => (view.time === "steps" ? step : grid.times[step]!);
    const steps = [...grid.times.keys()];
    const along = (values: ArrayLike<number>) => steps.map((i) => [instant(i), height(values[i]!)]);
    const around = (values: ArrayLike<number>) => steps.map((i) => [grid.indentations[i]!, height(values[i]!)]);
    const reach = band && Number.isFinite(band.pullOff[0]) ? [...band.lower, ...band.upper, ...band.pullOff] : [];
    const ticks = signed ? signedLogTicks([...force, ...(solver ?? []), ...reach]) : undefined;
    const style = { line: ink.line, muted: ink.muted };
    const time = (unit: string) => timeAxis(grid, view, style, unit);
    const phases = phaseBands(grid, instant, ink.band, ink.muted);
    const colour = picture.extrapolated ? ink.warn : ink.surrogate;

    const both = (path: (values: ArrayLike<number>) => number[][], x: number) => {
      const place = path(force);
      const ends = (i: number) => [place[i]![0]!, height(band!.lower[i]!), height(band!.upper[i]!)] as const;
      return [
        surrogateLine(place, picture.extrapolated, colour),
        ...(band ? bandArea(steps.map(ends), grid, ink) : []),
        ...(solver ? [solverLine(path(solver), ink)] : []),
        ...pullOffMarks(x, height(pullOff.force), band?.pullOff.map(height), ink),
      ];
    };
    const travel = steps.map((i) => [instant(i), grid.indentations[i]!]);
    const path = { ...surrogateLine(travel, false, ink.path), showSymbol: false, lineStyle: { width: 2 } };
    this.frame("protocol", picture, [{ ...path, markArea: phases }], time(""), valueAxis("", style));

    // Between two steps the pull-off lies between their places on a stretched axis, too.
    const top = view.time === "real" ? pullOff.time : linearly(pullOff.time, grid.times, steps);
    const [first, ...others] = both(along, top);
    const history = [{ ...first, markArea: phases }, ...others];
    this.frame("history", picture, history, time(picture.names.time), valueAxis("", style, ticks));
    const depth = {
      ...valueAxis(`indentation δ / ${picture.names.length}`, style),
      nameLocation: "middle",
      nameGap: 26,
      splitLine: { show: false },
    };
    const deep = linearly(pullOff.time, grid.times, grid.indentations);
    this.frame("loop", picture, both(around, deep), depth, valueAxis("", style, ticks));

    this.hosts.residual.hidden = !solver;
    if (solver) {
      const { difference, ends } = residuals(picture, solver);
      const line = surrogateLine(
        steps.map((i) => [instant(i), difference[i]!]),
        picture.extrapolated,
        colour,
      );
      const between = ends ? steps.map((i) => [instant(i), ends.lower[i]!, ends.upper[i]!] as const) : [];
      const area = ends ? bandArea(between, grid, ink) : [];
      const drawn = [{ ...line, markArea: phases }, ...area];
      this.frame("residual", picture, drawn, time(picture.names.time), valueAxis("", style));
    }
    this.label(picture);
    this.mark(this.instant);
  }

  /** Mark a place between the measurement steps on the solver's force, or none. */
  mark(step: number | undefined): void {
    this.instant = step;
    if (!this.last) return;
    const [{ grid, solver }, view] = this.last;
    const steps = [...grid.times.keys()];
    const of = (values: ArrayLike<number>) => linearly(step!, steps, values);
    const place = { history: view.time === "steps" ? steps : grid.times, loop: grid.indentations };
    for (const name of ["history", "loop"] as const) {
      const value = step !== undefined && solver ? of(solver) : NaN;
      const data = Number.isNaN(value) ? [] : [[of(place[name]), view.force === "log" ? toSignedLog(value) : value]];
      const ring = { color: "transparent", borderColor: colours().solver, borderWidth: 2 };
      const series = { id: "instant", type: "scatter", data, symbolSize: 14, itemStyle: ring, silent: true, z: 5 };
      this.chart(name).setOption({ series: [series] });
    }
  }

  private frame(place: Place, picture: Picture, series: object[], x: object, y: object): void {
    const ink = colours();
    // On a phone all entries have to stand in one row.
    const narrow = this.hosts[place].clientWidth < 430;
    const legend = {
      bottom: 4,
      left: "center",
      itemWidth: narrow ? 15 : 22,
      itemGap: narrow ? 6 : 10,
      data: LEGEND.filter(({ name }) => series.some((one) => (one as { name: string }).name === name)),
      textStyle: { color: ink.text, fontSize: narrow ? 11 : 12 },
      selectedMode: false,
    };
    this.chart(place).setOption(
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
        legend: place === "protocol" || place === "residual" ? { show: false } : legend,
        grid: {
          // The same left edge for all over time, so that their phases line up.
          left: 58,
          right: 22,
          top: place === "loop" ? 72 : 40,
          bottom: { protocol: 26, history: 66, loop: 66, residual: 44 }[place],
          outerBoundsMode: "none",
        },
        tooltip: {
          trigger: "axis",
          confine: true,
          axisPointer: { type: "line", snap: true },
          backgroundColor: ink.paper,
          borderColor: ink.line,
          textStyle: { color: ink.text, fontSize: 12 },
          formatter: (params: unknown) => this.describe(params, picture),
          ...(place === "loop" ? { trigger: "item" } : {}),
        },
        xAxis: x,
        yAxis: y,
        series,
      },
      { notMerge: true },
    );
  }

  /** All charts in one picture, as a PNG in a data URL. */
  png(): string {
    // A hidden chart has no size to be drawn in.
    for (const [place, chart] of this.charts) chart.group = this.hosts[place].hidden ? "" : GROUP;
    echarts.connect(GROUP);
    const paper = colours().paper;
    const url = this.chart("loop").getConnectedDataURL({ type: "png", pixelRatio: 2, backgroundColor: paper });
    echarts.disconnect(GROUP);
    return url;
  }

  private describe(params: unknown, { grid, force, solver, pullOff, band }: Picture): string {
    const points = [params].flat() as { dataIndex: number; seriesName: string }[];
    const i = points.find((point) => point.seriesName !== "pull-off")?.dataIndex ?? pullOff.step;
    const lines = [`time ${significant(grid.times[i]!, 4)}`, `indentation ${significant(grid.indentations[i]!, 4)}`];
    lines.push(`surrogate ${significant(force[i]!, 4)}`);
    if (band && Number.isFinite(band.lower[i])) {
      lines.push(`90 %: ${significant(band.lower[i]!, 4)} to ${significant(band.upper[i]!, 4)}`);
    }
    if (solver) lines.push(`solver ${significant(solver[i]!, 4)}`);
    return lines.join("<br>");
  }

  private label(picture: Picture): void {
    const { grid, force, solver, pullOff, caption } = picture;
    const [duration, peak] = [grid.times[grid.ends[2]]!, grid.indentations[grid.ends[0]]!].map((v) =>
      significant(v, 4),
    );
    const top = `pull-off force ${significant(pullOff.force, 4)} at time ${significant(pullOff.time, 4)}`;
    const say = (place: Place, text: string) => this.hosts[place].setAttribute("aria-label", text);
    say("protocol", `Indentation against time: up to ${peak}, held, and back, in a time of ${duration}.`);
    say("history", `Force against time: ${top}.`);
    say("loop", `Force against indentation for ${caption}: ${top}.`);
    if (!solver) return;
    const largest = force.reduce((most, value, step) => Math.max(most, Math.abs(value - solver[step]!)), 0);
    say("residual", `Surrogate minus solver against time: at most ${significant(largest, 4)} in size.`);
  }
}

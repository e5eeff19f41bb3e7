/**
 * The pretrained model `fast`, evaluated here: features, dense network, results, interval and band, of the numbers that
 * `python -m experiments.demo_model` writes. Mirrors `surrogate/data/physics.py`, `scaling.py` and `surrogate/intervals.py`
 * for one protocol within the training.
 */

import { fetchFile } from "./files";
import type { Band, Model, Prediction, Ranges } from "./model";
import { physicalGrid } from "./physical_steps";
import type { Counts, Grid, Protocol } from "./protocol";
import { Trouble } from "./trouble";

const FAST_FILE = "./fast.bin";
/** Of the symmetric logarithm of each channel, the Tabor parameter last. */
const PASSES = [2, 1, 1, 0, 0, 1, 1, 1, 1, 0, 0, 0, 1];
const KNOWN = ["tabor", "peak_indentation", "loading_rate", "dwell_time", "unloading_rate", "modulus_ratio"] as const;
const OUTERMOST = 0.2;
const NEARLY_ELASTIC = [0.95, 0.98, 0.995];
const GROUPS = 8;
const CORNERS = 2 ** KNOWN.length;
const LEAST = 1e-4;

interface Head {
  format: string;
  name: string;
  counts: Counts;
  steps: number[];
  mean: number[];
  deviation: number[];
  force: [number, number];
  ranges: Ranges;
  arrays: Record<string, number[]>;
}

const symlog = (value: number) => Math.sign(value) * Math.log1p(Math.abs(value));
const symexp = (value: number) => Math.sign(value) * Math.expm1(Math.abs(value));

export class Fast implements Model {
  private constructor(
    private readonly head: Head,
    private readonly arrays: Record<string, Float32Array>,
  ) {}

  /** @throws Trouble where the bytes are no such file. */
  static read(content: Uint8Array<ArrayBuffer>): Fast {
    const end = content.indexOf(10) + 1;
    try {
      const head = JSON.parse(new TextDecoder().decode(content.subarray(0, end))) as Head;
      const arrays: Record<string, Float32Array> = {};
      let at = end;
      for (const [name, shape] of Object.entries(head.arrays)) {
        const size = shape.reduce((product, length) => product * length, 1);
        arrays[name] = new Float32Array(content.buffer, content.byteOffset + at, size);
        at += 4 * size;
      }
      if (head.format === "contact-demo-model" && at === content.length) return new Fast(head, arrays);
    } catch {
      // Said below.
    }
    throw new Trouble(`The model could not be read: ${FAST_FILE} is not what experiments.demo_model writes.`);
  }

  static async load(): Promise<Fast> {
    return Fast.read(await fetchFile(FAST_FILE, "The model"));
  }

  get name(): string {
    return this.head.name;
  }

  get ranges(): Ranges {
    return this.head.ranges;
  }

  predict(protocol: Protocol): Promise<Prediction> {
    return Promise.resolve(this.evaluate(protocol));
  }

  /** @throws Trouble where instants cannot be told apart. */
  evaluate(protocol: Protocol): Prediction {
    const grid = physicalGrid(protocol, this.head.counts);
    const [mean, deviation] = this.head.force;
    const scaled = this.network(this.inputs(protocol, grid));
    const unscaled = (value: number) => symexp(value * deviation + mean);
    const force = scaled.map(unscaled);
    const { sharpness, ...readings } = results(grid, force);
    const [halves, row] = this.halfWidths([...KNOWN.map((name) => protocol[name]), sharpness]);
    const shape = this.arrays["shape"]!.subarray(row * force.length, (row + 1) * force.length);
    const end = (sign: number) => scaled.map((value, i) => unscaled(value + sign * halves[3]! * shape[i]!));
    const interval = [-1, 1].map((sign) => readings.pullOff.force * Math.exp(sign * halves[0]!));
    const band: Band = { lower: end(-1), upper: end(1), pullOff: interval as [number, number] };
    return { grid, force, ...readings, band };
  }

  /** The scaled channels of the steps that the network reads, step by step, in single precision. */
  private inputs(protocol: Protocol, grid: Grid): Float32Array {
    const rows = channels(protocol, grid);
    const { steps, mean, deviation } = this.head;
    return Float32Array.from(
      steps.flatMap((step) =>
        rows[step]!.map((value, column) => {
          for (let pass = 0; pass < PASSES[column]!; pass++) value = symlog(value);
          return (value - mean[column]!) / deviation[column]!;
        }),
      ),
    );
  }

  /** Dense layers, with the exact GELU between them. */
  private network(inputs: Float32Array): Float64Array {
    let values = Float64Array.from(inputs);
    for (let layer = 0; this.arrays[`layer_${layer}`]; layer += 2) {
      const [kernel, bias] = [this.arrays[`layer_${layer}`]!, this.arrays[`layer_${layer + 1}`]!];
      if (layer > 0) values = values.map((x) => 0.5 * x * (1 + erf(x * Math.SQRT1_2)));
      const next = Float64Array.from(bias);
      values.forEach((value, i) => {
        for (let j = 0, at = i * next.length; j < next.length; j++, at++) next[j]! += value * kernel[at]!;
      });
      values = next;
    }
    return values;
  }

  /** Half-widths of pull-off force, time, loop, force and curve, and the row of `shape`, as of `Bands.half_widths`. */
  private halfWidths(predictors: number[]): [number[], number] {
    const { ranges, coefficients, edges, quantiles } = this.arrays;
    const logarithms = predictors.map((value) => Math.log(Math.max(value, LEAST)));
    const places = KNOWN.map((_, i) => {
      const [low, high] = [Math.log(ranges![2 * i]!), Math.log(ranges![2 * i + 1]!)];
      return Math.min(Math.max((2 * logarithms[i]! - low - high) / (high - low), -1), 1);
    });
    const terms = products([1, ...places, 1 + logarithms[KNOWN.length]! / 4]);
    const outermost = places.every((place) => Math.abs(place) >= 1 - 2 * OUTERMOST - 1e-9);
    let own = outermost ? places.reduce((sum, place, bit) => sum + (place > 0 ? 2 ** bit : 0), 0) : -1;
    NEARLY_ELASTIC.forEach((ratio, i) => {
      if (predictors[KNOWN.length - 1]! >= ratio) own = CORNERS + GROUPS + i;
    });
    const cells = CORNERS + GROUPS + NEARLY_ELASTIC.length;
    const groups: number[] = [];
    const halves = Array.from({ length: coefficients!.length / terms.length }, (_, kind) => {
      const size = terms.reduce((sum, term, i) => sum + term * coefficients![kind * terms.length + i]!, 0);
      const bounds = edges!.subarray(kind * (GROUPS - 1), (kind + 1) * (GROUPS - 1));
      groups.push(bounds.filter((bound) => size > bound).length);
      return Math.exp(size) * quantiles![kind * cells + (own >= 0 ? own : CORNERS + groups[kind]!)]!;
    });
    return [halves, groups[3]!];
  }
}

/** Products of three of the factors, in the order of Python's combinations. */
function products(factors: number[]): number[] {
  const found: number[] = [];
  factors.forEach((a, i) => {
    factors.slice(i).forEach((b, j) => factors.slice(i + j).forEach((c) => found.push(a * b * c)));
  });
  return found;
}

/** The channels of feature set F and the Tabor parameter, at each step. */
function channels({ tabor, modulus_ratio: ratio }: Protocol, { times, indentations, edge }: Grid): number[][] {
  const size = (-4 / (3 * Math.PI)) * Math.pow(tabor, -1.5);
  const carried = (memory: number, rate: number, step: number, change: number) => {
    const lost = -Math.expm1(-rate * step);
    return memory + (lost / (rate * step)) * change - lost * memory;
  };
  let [memory, relaxation, retardation, before] = [0, 0, 0, 0];
  return [...times].map((time, i) => {
    const here = indentations[i]!;
    const hertz = here > 0 ? size * here * Math.sqrt(here) : 0;
    const step = i > 0 ? time - times[i - 1]! : 0;
    const change = i > 0 ? here - indentations[i - 1]! : 0;
    if (i > 0) {
      memory = carried(memory, 1 / ratio, step, hertz - before);
      relaxation = carried(relaxation, 1 / ratio, step, change);
      retardation = carried(retardation, 1, step, change);
    } else memory = hertz;
    before = hertz;
    const velocity = i > 0 ? change / step : 0;
    const kinematics = [time, here, velocity, edge[i]!, i > 0 ? Math.log(step) : 0];
    const solid = [hertz + (1 / ratio - 1) * memory, hertz, relaxation, retardation, Math.log(ratio)];
    return [...kinematics, ...solid, Number(velocity > 0), Number(velocity < 0), tabor];
  });
}

/** The error function, by a series of positive terms. */
function erf(x: number): number {
  if (Math.abs(x) > 6) return Math.sign(x);
  let term = x;
  let sum = x;
  for (let n = 1; Math.abs(term) > 1e-17 * Math.abs(sum); n++) {
    term *= (2 * x * x) / (2 * n + 1);
    sum += term;
  }
  return (2 / Math.sqrt(Math.PI)) * Math.exp(-x * x) * sum;
}

/** Pull-off by a parabola through the highest step of the unloading, its sharpness, and the work of monotone cubics. */
function results(grid: Grid, force: Float64Array) {
  const { times } = grid;
  const [loaded, turn, last] = grid.ends;
  let step = turn;
  for (let i = turn; i <= last; i++) if (force[i]! > force[step]!) step = i;
  let [top, time, sharpness] = [force[step]!, times[step]!, 0];
  if (step > turn && step < last) {
    const [before, after] = [times[step]! - times[step - 1]!, times[step + 1]! - times[step]!];
    const [rise, fall] = [(top - force[step - 1]!) / before, (force[step + 1]! - top) / after];
    const bend = (fall - rise) / (before + after);
    sharpness = 1 - Math.max(force[step - 1]!, force[step + 1]!) / Math.max(top, 1e-300);
    if (bend < 0) {
      const slope = rise + bend * before;
      top -= (0.25 * slope * slope) / bend;
      time -= (0.5 * slope) / bend;
    }
  }
  const works = [
    [0, loaded],
    [turn, last],
  ].map(([first, end]) => {
    const span = grid.indentations[end!]! - grid.indentations[first!]!;
    const [instants, forces] = [times.subarray(first, end! + 1), force.subarray(first, end! + 1)];
    return (-integral(instants, forces) * span) / (times[end!]! - times[first!]!);
  });
  return { pullOff: { step, force: top, time }, sharpness, hysteresis: Math.abs(works[0]! + works[1]!) };
}

/** The integral of monotone cubics (Fritsch and Butland) through points, as of `bem/_support/monotone.py`. */
function integral(times: Float64Array, force: Float64Array): number {
  const last = times.length - 1;
  const width = (i: number) => times[i + 1]! - times[i]!;
  const chord = (i: number) => (force[i + 1]! - force[i]!) / width(i);
  const outer = (i: number, j: number) => {
    const [near, far] = [width(i), width(j)];
    const slope = ((2 * near + far) * chord(i) - near * chord(j)) / (near + far);
    if (slope * chord(i) <= 0) return 0;
    return chord(i) * chord(j) <= 0 && Math.abs(slope) > 3 * Math.abs(chord(i)) ? 3 * chord(i) : slope;
  };
  const slope = (i: number) => {
    if (i === 0) return outer(0, 1);
    if (i === last) return outer(last - 1, last - 2);
    if (chord(i - 1) * chord(i) <= 0) return 0;
    const [weight, next] = [2 * width(i) + width(i - 1), width(i) + 2 * width(i - 1)];
    return (weight + next) / (weight / chord(i - 1) + next / chord(i));
  };
  let total = 0;
  for (let i = 0; i < last; i++) {
    total += width(i) * (0.5 * (force[i]! + force[i + 1]!) + (width(i) * (slope(i) - slope(i + 1))) / 12);
  }
  return total;
}

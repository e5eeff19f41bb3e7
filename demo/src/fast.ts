/**
 * The pretrained model `fast`, evaluated here, of the numbers that `python -m experiments.demo_model` writes: results first,
 * then the force at steps around the predicted pull-off. Mirrors `surrogate/solids.py` for one standard linear solid.
 */

import { fetchFile } from "./files";
import { covered, halfWidths } from "./intervals";
import { Solid } from "./lee_radok";
import type { Band, Model, Prediction, Ranges } from "./model";
import { part, Stage, type Arrays, type Places } from "./network";
import { corners, nearest, type Counts, type Grid, type Protocol } from "./protocol";
import { pullOffGrid } from "./pull_off_steps";
import { forcesWithoutAdhesion, solidFeatures } from "./solid_features";
import { Trouble } from "./trouble";

const FAST_FILE = "./fast.bin";
const LEAST_LOOP = 0.05;
/** The share of the unloading steps at which the second front is evaluated. */
const RELEASE = 0.36;
/** Added to the travel beyond the pull-off before its logarithm. */
const BEYOND = 0.02;

interface Head {
  format: string;
  name: string;
  counts: Counts;
  ranges: Ranges;
  /** Shapes of the arrays in double and in single precision. */
  doubles: Record<string, number[]>;
  singles: Record<string, number[]>;
}

export class Fast implements Model {
  private readonly stages: readonly [Stage, Stage];
  private readonly reach: Arrays;
  private readonly intervals: Arrays;

  private constructor(
    private readonly head: Head,
    arrays: Arrays,
  ) {
    this.stages = [new Stage(part(arrays, "scalars")), new Stage(part(arrays, "curve"))];
    [this.reach, this.intervals] = [part(arrays, "reach"), part(arrays, "intervals")];
  }

  /** @throws Trouble where the bytes are no such file. */
  static read(content: Uint8Array<ArrayBuffer>): Fast {
    let at = content.indexOf(10) + 1;
    try {
      const head = JSON.parse(new TextDecoder().decode(content.subarray(0, at))) as Head;
      const arrays: Record<string, Float64Array> = {};
      for (const [shapes, Numbers] of [[head.doubles, Float64Array], [head.singles, Float32Array]] as const) {
        for (const [name, shape] of Object.entries(shapes)) {
          const size = shape.reduce((product, length) => product * length, 1);
          // In double precision, too, so that the loops over all of them know one kind of numbers.
          arrays[name] = Float64Array.from(new Numbers(content.buffer, content.byteOffset + at, size));
          at += size * Numbers.BYTES_PER_ELEMENT;
        }
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

  predict(protocol: Protocol): Promise<Prediction | undefined> {
    return Promise.resolve(this.evaluate(protocol));
  }

  evaluate(protocol: Protocol): Prediction | undefined {
    const { counts } = this.head;
    const features = solidFeatures(protocol);
    if (!covered(features, this.reach)) return undefined;
    const targets = this.stages[0].evaluate(features);
    const [top, travel, loop] = [...targets].map(Math.exp) as [number, number, number];
    const [, , turn, end] = corners(protocol).times as [number, number, number, number];
    const time = Math.min(turn + travel / protocol.unloading_rate, end);
    const grid = pullOffGrid(protocol, counts, time);
    const without = forcesWithoutAdhesion(grid, new Solid(protocol.modulus_ratio), protocol.tabor);
    const unloading = grid.ends[1] + 1;
    const unit = (step: number) => (step < unloading ? 1 : top);
    const learned = this.stages[1].evaluate([...features, ...targets], fronts(protocol, grid, counts, time));
    const force = learned.map((value, i) => {
      const predicted = unit(i) * Math.sinh(value + Math.asinh(without[i]! / unit(i)));
      // No force of the unloading exceeds the pull-off force.
      return i < unloading ? predicted : Math.min(predicted, top);
    });
    const step = unloading + nearest([...grid.times.subarray(unloading)], time);
    force[step] = top;
    const { half, shape } = halfWidths(features, protocol.modulus_ratio === 1, this.intervals);
    const moved = (sign: number) =>
      force.map((value, i) => unit(i) * Math.sinh(Math.asinh(value / unit(i)) + sign * half[targets.length]! * shape[i]!));
    const interval = [-1, 1].map((sign) => top * Math.exp(sign * half[0]!)) as [number, number];
    const band: Band = { lower: moved(-1), upper: moved(1), pullOff: interval };
    return { grid, force, pullOff: { step, force: top, time }, hysteresis: Math.max(loop - LEAST_LOOP, 0), band };
  }
}

/** Where the contact snaps in, and where it lets go: the steps of both fronts. */
function fronts({ tabor, unloading_rate: rate }: Protocol, { times, indentations }: Grid, counts: Counts, pullOffTime: number): Places[] {
  const coordinates = (first: number, end: number) =>
    [...indentations.subarray(first, end)].map((depth, i) => {
      const beyond = Math.max((times[first + i]! - pullOffTime) * rate, 0);
      const share = depth / tabor;
      return Float64Array.of(Math.asinh(depth), share / (1 + Math.abs(share)), Math.log(beyond + BEYOND));
    });
  const last = times.length - Math.round(RELEASE * counts[2]);
  return [
    { first: 1, coordinates: coordinates(1, counts[0]) },
    { first: last, coordinates: coordinates(last, times.length) },
  ];
}

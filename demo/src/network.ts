/**
 * The two stages of the model: a quadratic polynomial of standardised features, a dense network that corrects it, and
 * fronts, small networks at each of some steps. Mirrors `surrogate/data/dense.py`, `polynomial.py` and `fronts.py`.
 */

export type Arrays = Readonly<Record<string, Float64Array>>;

/** Where a front is evaluated: its first step, and the coordinates of each of its steps. */
export interface Places {
  first: number;
  coordinates: readonly Float64Array[];
}

/** The arrays of a part of the model, by their names in it. */
export function part(arrays: Arrays, name: string): Arrays {
  const own = Object.entries(arrays).filter(([key]) => key.startsWith(`${name}/`));
  return Object.fromEntries(own.map(([key, values]) => [key.slice(name.length + 1), values]));
}

export function standardised(features: readonly number[], { mean, deviation }: Arrays): Float64Array {
  return Float64Array.from(features, (value, i) => (value - mean![i]!) / deviation![i]!);
}

/** A quadratic polynomial: the coefficients are those of the constant, of each z, and of each product of two. */
export function polynomial(z: Float64Array, coefficients: Float64Array): Float64Array {
  const terms = new Float64Array((z.length * (z.length + 3)) / 2);
  terms.set(z);
  let at = z.length;
  z.forEach((first, i) => z.subarray(i).forEach((second) => (terms[at++] = first * second)));
  const count = coefficients.length / (terms.length + 1);
  return dense(terms, coefficients.subarray(count), coefficients.subarray(0, count));
}

function dense(values: Float64Array, kernel: Float64Array, bias: Float64Array): Float64Array {
  const next = Float64Array.from(bias);
  for (let i = 0, at = 0; i < values.length; i++) {
    const value = values[i]!;
    for (let j = 0; j < next.length; j++, at++) next[j]! += value * kernel[at]!;
  }
  return next;
}

export class Stage {
  private readonly fronts: Arrays[] = [];

  constructor(private readonly arrays: Arrays) {
    for (let i = 0; arrays[`front_${i}/place`]; i++) this.fronts.push(part(arrays, `front_${i}`));
  }

  /** Its targets. */
  evaluate(features: readonly number[], places: readonly Places[] = []): Float64Array {
    const { arrays } = this;
    const z = standardised(features, arrays);
    let hidden = z;
    let layer = 0;
    const next = () => dense(hidden, arrays[`kernel_${layer}`]!, arrays[`bias_${layer}`]!);
    for (; arrays[`kernel_${layer + 1}`]; layer++) hidden = next().map(gelu);
    const correction = next();
    this.fronts.forEach((front, i) => addFront(correction, front, hidden, places[i]!));
    const { offset, scale } = arrays;
    return polynomial(z, arrays["coefficients"]!).map((value, i) => value + correction[i]! * scale![i]! + offset![i]!);
  }
}

function addFront(correction: Float64Array, front: Arrays, hidden: Float64Array, { first, coordinates }: Places): void {
  const given = dense(hidden, front["hidden"]!, front["bias"]!);
  coordinates.forEach((place, i) => {
    const units = dense(place, front["place"]!, given).map(positive);
    const second = dense(units, front["second"]!, front["second_bias"]!).map(positive);
    correction[first + i]! += dense(second, front["out"]!, front["out_bias"]!)[0]!;
  });
}

const positive = (x: number) => Math.max(x, 0);
const gelu = (x: number) => 0.5 * x * (1 + erf(x * Math.SQRT1_2));

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

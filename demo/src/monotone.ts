/** Monotone cubics through points (Fritsch and Butland), as SciPy's `PchipInterpolator` has them. */

/**
 * Interpolate between three or more points with increasing places.
 *
 * @returns Values at other places, which lie between the first and the last point.
 */
export function monotone(at: ArrayLike<number>, places: ArrayLike<number>, values: ArrayLike<number>): Float64Array {
  const last = places.length - 1;
  const width = (i: number) => places[i + 1]! - places[i]!;
  const chord = (i: number) => (values[i + 1]! - values[i]!) / width(i);
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
  let i = 0;
  return Float64Array.from(at, (place) => {
    if (place < places[i]!) i = 0;
    while (i < last - 1 && places[i + 1]! <= place) i++;
    const share = (place - places[i]!) / width(i);
    const rest = 1 - share;
    const bend = rest * slope(i) * width(i) - share * slope(i + 1) * width(i);
    return values[i]! * rest * rest * (1 + 2 * share) + values[i + 1]! * share * share * (3 - 2 * share) + share * rest * bend;
  });
}

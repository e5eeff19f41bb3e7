/** Numbers as the page shows them. */

/** A few significant digits, without trailing zeros after a point, with an exponent where that is shorter to read. */
export function significant(value: number, digits = 5): string {
  if (!Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const rounded = Number(value.toPrecision(digits));
  const size = Math.abs(rounded);
  if (size >= 1e6 || size < 1e-4) return rounded.toExponential().replace("-", "−").replace("e+", "e");
  return String(rounded).replace("-", "−");
}

export function percent(value: number): string {
  if (value < 0.01) return "<\u00a00.01\u00a0%";
  return `${value < 10 ? value.toFixed(2) : value.toFixed(1)}\u00a0%`;
}

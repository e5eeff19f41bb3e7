/**
 * Laboratory units: what the dimensionless quantities of the page are for one contact, given in SI units.
 *
 * The Tabor parameter of the protocol fixes the equilibrium gap of the contact, h0 = (R Δγ² / E*²)^(1/3) / μ, so that the
 * scale of lengths follows the slider. Mirrors `bem/lab/setup.py`.
 */

import { significant } from "./format";

export const CONTACT = ["radius", "adhesion", "modulus", "retardation"] as const;
/** Radius in m, work of adhesion in J/m², relaxed plane-strain modulus in Pa, retardation time in s. */
export type Contact = Record<(typeof CONTACT)[number], number>;
/** A tip of 20 nm on a polymer of 1 GPa. */
export const USUAL_CONTACT: Contact = { radius: 20e-9, adhesion: 0.05, modulus: 1e9, retardation: 0.01 };

/** One dimensionless unit in SI units, or in itself, with its name. */
interface Scale {
  size: number;
  name: string;
}
export interface Units {
  length: Scale;
  time: Scale;
  force: Scale;
  work: Scale;
  laboratory: boolean;
}

export const DIMENSIONLESS: Units = {
  length: { size: 1, name: "h₀" },
  time: { size: 1, name: "τ" },
  force: { size: 1, name: "π R Δγ" },
  work: { size: 1, name: "π R Δγ h₀" },
  laboratory: false,
};

export function unitsOf({ radius, adhesion, modulus, retardation }: Contact, tabor: number): Units {
  const gap = Math.cbrt((radius * adhesion * adhesion) / (modulus * modulus)) / tabor;
  const force = Math.PI * radius * adhesion;
  return {
    length: { size: gap, name: "m" },
    time: { size: retardation, name: "s" },
    force: { size: force, name: "N" },
    work: { size: force * gap, name: "J" },
    laboratory: true,
  };
}

const PREFIXES = ["a", "f", "p", "n", "µ", "m", "", "k", "M", "G"];

const ONE = PREFIXES.indexOf("");

/** A scale whose numbers are handy for values up to this one: with a prefix where it is in SI units. */
export function handy(scale: Scale, laboratory: boolean, largest: number): Scale {
  if (!laboratory || largest === 0) return scale;
  const thousands = Math.floor(Math.log10(Math.abs(largest) * scale.size) / 3 + 1e-9);
  const place = Math.min(Math.max(thousands + ONE, 0), PREFIXES.length - 1);
  return { size: scale.size / Math.pow(1000, place - ONE), name: PREFIXES[place] + scale.name };
}

/** A value with its unit, in two parts. */
export function worded(value: number, scale: Scale, laboratory: boolean): [string, string] {
  const { size, name } = handy(scale, laboratory, value);
  return [significant(value * size), name];
}

/** Scales whose numbers are handy for the largest indentation, time and force of what is shown. */
export function handyScales(units: Units, indentation: number, time: number, force: number) {
  const { laboratory } = units;
  return {
    length: handy(units.length, laboratory, indentation),
    time: handy(units.time, laboratory, time),
    force: handy(units.force, laboratory, force),
  };
}

/** Protocol and view in the address of the page, after the `#`, so that a link shares what is on the screen. */

import { USUAL_VIEW, VIEWS, type View } from "./axes";
import { complaint, QUANTITIES, type Protocol, type Quantity } from "./protocol";
import { MODELS, type Name } from "./shelf";
import { Trouble } from "./trouble";
import { CONTACT, USUAL_CONTACT, type Contact } from "./units";

const DECIMAL = /^\s*[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?\s*$/i;

/** The quantities of a protocol. */
export function protocolFragment(protocol: Protocol): string {
  return QUANTITIES.map((name) => `${name}=${Number(protocol[name].toPrecision(8))}`).join("&");
}

/** What a link says. */
export interface State {
  protocol: Protocol;
  view: View;
  contact: Contact;
  model: Name;
  /** A protocol to compare with. */
  pinned?: Protocol;
  /** Of the film, where it does not stand at the pull-off. */
  instant?: number;
}

const values = (protocol: Protocol) => QUANTITIES.map((name) => Number(protocol[name].toPrecision(8)));

/** The protocol, and model, view, pinned protocol and instant where they are not the usual ones; in laboratory units, the contact too. */
export function toFragment({ protocol, view, contact, model, pinned, instant }: State): string {
  const axes = (["time", "force", "units"] as const).filter((axis) => view[axis] !== USUAL_VIEW[axis]);
  const shown = view.units === "laboratory" ? CONTACT : [];
  return [
    protocolFragment(protocol),
    ...(model === MODELS[0] ? [] : [`model=${model}`]),
    ...axes.map((axis) => `${axis}=${view[axis]}`),
    ...shown.map((name) => `${name}=${Number(contact[name].toPrecision(8))}`),
    ...(pinned ? [`pinned=${values(pinned).join(",")}`] : []),
    ...(instant === undefined ? [] : [`instant=${Number(instant.toPrecision(12))}`]),
  ].join("&");
}

/**
 * Read a fragment. What it leaves out comes from `fallback` and the usual view; keys that are none of these, as other
 * sites add to links, are passed over.
 *
 * @param paper The modulus ratio of the paper's model, which knows no other.
 * @throws Trouble naming what is wrong.
 */
export function fromFragment(fragment: string, fallback: Protocol, paper: number): State {
  // A plus sign belongs to an exponent here, it is no space.
  const given = new URLSearchParams(fragment.replace(/^#/, "").replaceAll("+", "%2B"));
  const single = (name: string) => {
    const [text, ...others] = given.getAll(name);
    if (others.length) throw new Trouble(`The link gives ${name} more than once.`);
    return text;
  };
  /** A number in a text; of a quantity, one that it may have; an instant may be zero. */
  const number = (key: string, text: string, quantity?: Quantity) => {
    const value = DECIMAL.test(text) ? Number(text) : NaN;
    const positive = value > 0 || (key === "instant" && value === 0);
    const usable = quantity ? !complaint(value, quantity) : positive && Number.isFinite(value);
    if (!usable) throw new Trouble(`The link gives ${key} = “${text}”, which is no usable number.`);
    return value;
  };
  const choice = <T extends string>(name: string, allowed: readonly T[]): T => {
    const text = single(name) ?? allowed[0];
    const found = allowed.find((value) => value === text);
    if (!found) throw new Trouble(`The link gives ${name} = “${text}”, which is neither ${allowed.join(" nor ")}.`);
    return found;
  };
  const protocol = { ...fallback };
  for (const name of QUANTITIES) {
    const text = single(name);
    if (text !== undefined) protocol[name] = number(name, text, name);
  }
  const contact = { ...USUAL_CONTACT };
  for (const name of CONTACT) {
    const text = single(name);
    if (text !== undefined) contact[name] = number(name, text);
  }
  const model = choice("model", MODELS);
  if (model !== "fast" && protocol.modulus_ratio !== paper) {
    throw new Trouble(`The link gives modulus_ratio = “${protocol.modulus_ratio}”, but ${model} knows ${paper} only.`);
  }
  const view = { time: choice("time", VIEWS.time), force: choice("force", VIEWS.force), units: choice("units", VIEWS.units) };
  const instant = single("instant");
  return {
    ...{ protocol, view, contact, model, pinned: pinnedOf(single("pinned"), number) },
    instant: instant === undefined ? undefined : number("instant", instant),
  };
}

function pinnedOf(text: string | undefined, number: (key: string, text: string, quantity: Quantity) => number) {
  if (text === undefined) return undefined;
  const parts = text.split(",");
  if (parts.length !== QUANTITIES.length) {
    throw new Trouble(`The link gives pinned = “${text}”, which must be ${QUANTITIES.length} numbers.`);
  }
  return Object.fromEntries(QUANTITIES.map((name, i) => [name, number("pinned", parts[i]!, name)])) as Protocol;
}

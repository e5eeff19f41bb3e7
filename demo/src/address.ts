/** Protocol and view in the address of the page, after the `#`, so that a link shares what is on the screen. */

import { USUAL_VIEW, VIEWS, type View } from "./axes";
import { complaint, QUANTITIES, type Protocol } from "./protocol";
import { Trouble } from "./trouble";
import { CONTACT, USUAL_CONTACT, type Contact } from "./units";

const DECIMAL = /^\s*[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?\s*$/i;

export function protocolFragment(protocol: Protocol): string {
  return QUANTITIES.map((name) => `${name}=${Number(protocol[name].toPrecision(8))}`).join("&");
}

/** The protocol, and the view where it is not the usual one; in laboratory units, the contact too. */
export function toFragment(protocol: Protocol, view: View, contact: Contact): string {
  const axes = (["time", "force", "units"] as const).filter((axis) => view[axis] !== USUAL_VIEW[axis]);
  const shown = view.units === "laboratory" ? CONTACT : [];
  return [
    protocolFragment(protocol),
    ...axes.map((axis) => `${axis}=${view[axis]}`),
    ...shown.map((name) => `${name}=${Number(contact[name].toPrecision(8))}`),
  ].join("&");
}

/**
 * Read protocol and view from a fragment. What it leaves out comes from `fallback` and the usual view; keys that are
 * neither, as other sites add to links, are passed over.
 *
 * @throws Trouble naming what is wrong.
 */
export function fromFragment(fragment: string, fallback: Protocol): { protocol: Protocol; view: View; contact: Contact } {
  // A plus sign belongs to an exponent here, it is no space.
  const given = new URLSearchParams(fragment.replace(/^#/, "").replaceAll("+", "%2B"));
  const single = (name: string) => {
    const [text, ...others] = given.getAll(name);
    if (others.length) throw new Trouble(`The link gives ${name} more than once.`);
    return text;
  };
  const protocol = { ...fallback };
  for (const name of QUANTITIES) {
    const text = single(name);
    if (text === undefined) continue;
    const value = DECIMAL.test(text) ? Number(text) : NaN;
    if (complaint(value)) throw new Trouble(`The link gives ${name} = “${text}”, which is no usable number.`);
    protocol[name] = value;
  }
  const contact = { ...USUAL_CONTACT };
  for (const name of CONTACT) {
    const text = single(name);
    if (text === undefined) continue;
    const value = DECIMAL.test(text) ? Number(text) : NaN;
    if (!(value > 0 && Number.isFinite(value)))
      throw new Trouble(`The link gives ${name} = “${text}”, which is no usable number.`);
    contact[name] = value;
  }
  const choice = <T extends string>(name: string, allowed: readonly T[], usual: T): T => {
    const text = single(name);
    const found = text === undefined ? usual : allowed.find((value) => value === text);
    if (!found) throw new Trouble(`The link gives ${name} = “${text}”, which is neither ${allowed.join(" nor ")}.`);
    return found;
  };
  const view = {
    time: choice("time", VIEWS.time, USUAL_VIEW.time),
    force: choice("force", VIEWS.force, USUAL_VIEW.force),
    units: choice("units", VIEWS.units, USUAL_VIEW.units),
  };
  return { protocol, view, contact };
}

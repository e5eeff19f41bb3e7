/** Protocol and view in the address of the page, after the `#`, so that a link shares what is on the screen. */

import { USUAL_VIEW, VIEWS, type View } from "./axes";
import { PRETRAINED_NAMES } from "./model_file";
import { complaint, QUANTITIES, type Protocol } from "./protocol";
import { Trouble } from "./trouble";
import { CONTACT, USUAL_CONTACT, type Contact } from "./units";

const DECIMAL = /^\s*[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?\s*$/i;

/** The quantities of a protocol, with the modulus ratio where the model takes it. */
export function protocolFragment(protocol: Protocol, solid: boolean): string {
  const given = QUANTITIES.filter((name) => solid || name !== "modulus_ratio");
  return given.map((name) => `${name}=${Number(protocol[name].toPrecision(8))}`).join("&");
}

/** What a link says: `model` is undefined for the model of the paper, and else the name of a pretrained one. */
export interface State {
  protocol: Protocol;
  view: View;
  contact: Contact;
  model?: string;
}

/** The protocol, the model and the view where they are not the usual ones; in laboratory units, the contact too. */
export function toFragment({ protocol, view, contact, model }: State): string {
  const axes = (["time", "force", "units"] as const).filter((axis) => view[axis] !== USUAL_VIEW[axis]);
  const shown = view.units === "laboratory" ? CONTACT : [];
  return [
    protocolFragment(protocol, model !== undefined),
    ...(model ? [`model=${model}`] : []),
    ...axes.map((axis) => `${axis}=${view[axis]}`),
    ...shown.map((name) => `${name}=${Number(contact[name].toPrecision(8))}`),
  ].join("&");
}

/**
 * Read protocol, model and view from a fragment. What it leaves out comes from `fallback` and the usual view; keys that
 * are none of these, as other sites add to links, are passed over.
 *
 * @param paper The name of the paper's model, which knows the modulus ratio of `fallback` only.
 * @throws Trouble naming what is wrong.
 */
export function fromFragment(fragment: string, fallback: Protocol, paper: string): State {
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
    if (complaint(value, name)) throw new Trouble(`The link gives ${name} = “${text}”, which is no usable number.`);
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
  const chosen = choice("model", [paper, ...PRETRAINED_NAMES], paper);
  const model = chosen === paper ? undefined : chosen;
  if (!model && protocol.modulus_ratio !== fallback.modulus_ratio) {
    throw new Trouble(
      `The link gives modulus_ratio = “${protocol.modulus_ratio}”, but ${paper} knows ${fallback.modulus_ratio} only; ` +
        `add model=${PRETRAINED_NAMES.join(" or model=")}.`,
    );
  }
  const view = {
    time: choice("time", VIEWS.time, USUAL_VIEW.time),
    force: choice("force", VIEWS.force, USUAL_VIEW.force),
    units: choice("units", VIEWS.units, USUAL_VIEW.units),
  };
  return { protocol, view, contact, model };
}

/** A protocol in the address of the page, after the `#`, so that a link shares what is on the screen. */

import { complaint, QUANTITIES, type Protocol } from "./protocol";

export function toFragment(protocol: Protocol): string {
  return QUANTITIES.map((name) => `${name}=${Number(protocol[name].toPrecision(8))}`).join("&");
}

/**
 * Read a protocol from a fragment; what it leaves out comes from `fallback`.
 *
 * @throws Error with one sentence naming the quantity that is wrong.
 */
export function fromFragment(fragment: string, fallback: Protocol): Protocol {
  const given = new URLSearchParams(fragment.replace(/^#/, ""));
  const protocol = { ...fallback };
  for (const [name, text] of given) {
    const quantity = QUANTITIES.find((known) => known === name);
    if (!quantity) throw new Error(`The link names “${name}”, which is no quantity of a protocol.`);
    const value = text.trim() === "" ? NaN : Number(text);
    if (complaint(value)) throw new Error(`The link gives ${quantity} = “${text}”, which is no usable number.`);
    protocol[quantity] = value;
  }
  return protocol;
}

/** The files beside the page. */

import { Trouble } from "./trouble";

/**
 * Fetch a file whole.
 *
 * @param what The file in words, at the start of the sentence.
 * @throws Trouble where it cannot be had.
 */
export async function fetchFile(url: string, what: string, options?: RequestInit): Promise<Uint8Array<ArrayBuffer>> {
  let reason = `${url} cannot be reached`;
  try {
    const response = await fetch(url, options);
    if (response.ok) return new Uint8Array(await response.arrayBuffer());
    reason = `${url} answers ${response.status}`;
  } catch {
    // The browser gives no reason that would help a reader.
  }
  throw new Trouble(`${what} could not be loaded (${reason}).`);
}

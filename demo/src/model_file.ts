/** What the metadata of an ONNX file of `surrogate export` say of a model. */

import { readMetadata } from "./onnx_metadata";
import { QUANTITIES, type Counts, type Quantity } from "./protocol";
import { Trouble } from "./trouble";

const PAPER = "viscoelastic-contact-surrogate-onnx";
const PRETRAINED = "viscoelastic-contact-pretrained-onnx";
const VERSION = "1";
/** Names of the pretrained models, in links and of files. */
export const PRETRAINED_NAMES = ["fast", "accurate"] as const;

export type Ranges = Record<Quantity, readonly [number, number]>;

export interface Description {
  name: string;
  ranges: Ranges;
  /** Of a pretrained model. */
  counts?: Counts;
}

/**
 * Read the metadata of a file.
 *
 * @param modulusRatio Of the solid of a model that does not state one.
 * @throws Trouble where it is none of our models, or one of another version.
 */
export function readDescription(bytes: Uint8Array, url: string, modulusRatio: number): Description {
  const metadata = readMetadata(bytes);
  const foreign = `${url} is not a surrogate of this project`;
  const format = metadata.get("format");
  const ranges = json<Partial<Ranges>>(metadata.get("ranges"));
  const complete = { modulus_ratio: [modulusRatio, modulusRatio], ...ranges } as Ranges;
  const known = (format === PAPER || format === PRETRAINED) && ranges && areRanges(complete);
  if (!known) throw new Trouble(`${foreign}: its metadata do not say so.`);
  if (metadata.get("format_version") !== VERSION) {
    throw new Trouble(`${foreign}: expected version ${VERSION}, received ${metadata.get("format_version")}.`);
  }
  const about = { name: metadata.get("name") ?? "surrogate", ranges: complete };
  if (format === PAPER) return about;
  const counts = json<number[]>(metadata.get("counts"));
  const whole = counts?.length === 3 && counts.every((count) => Number.isInteger(count) && count > 1);
  if (!whole) throw new Trouble(`${foreign}: its metadata do not say how many steps it has.`);
  return { ...about, counts: counts as unknown as Counts };
}

function json<T>(text: string | undefined): T | undefined {
  try {
    return (JSON.parse(text ?? "null") as T | null) ?? undefined;
  } catch {
    return undefined;
  }
}

function areRanges(ranges: Ranges): boolean {
  const isPair = (values: unknown) => Array.isArray(values) && values.length === 2 && values.every(Number.isFinite);
  return QUANTITIES.every((name) => isPair(ranges[name]));
}

/**
 * The metadata an ONNX file carries, which ONNX Runtime Web does not hand out.
 *
 * An ONNX file is a protocol buffer; `metadata_props` is field 14 of its root message, each entry a message of key
 * (field 1) and value (field 2). Every other field is stepped over by its length.
 */

const METADATA_FIELD = 14;

/** Key and value of every metadata entry; empty where the bytes are no protocol buffer. */
export function readMetadata(bytes: Uint8Array): Map<string, string> {
  const found = new Map<string, string>();
  try {
    for (const { field, payload } of fields(bytes)) {
      if (field !== METADATA_FIELD || !payload) continue;
      const entry = new Map([...fields(payload)].map((part) => [part.field, part.payload]));
      const [key, value] = [1, 2].map((number) => new TextDecoder().decode(entry.get(number)));
      found.set(key!, value!);
    }
  } catch (error) {
    if (!(error instanceof RangeError)) throw error;
    return new Map();
  }
  return found;
}

function* fields(bytes: Uint8Array): Generator<{ field: number; payload?: Uint8Array }> {
  let at = 0;
  const varint = () => {
    let value = 0;
    for (let shift = 0; ; shift += 7) {
      if (at >= bytes.length || shift > 63) throw new RangeError("not a protocol buffer");
      const byte = bytes[at++]!;
      value += (byte & 0x7f) * 2 ** shift;
      if (byte < 0x80) return value;
    }
  };
  while (at < bytes.length) {
    const tag = varint();
    const [field, wire] = [Math.floor(tag / 8), tag % 8];
    if (wire === 0) {
      varint();
      yield { field };
    } else if (wire === 2) {
      const length = varint();
      if (at + length > bytes.length) throw new RangeError("not a protocol buffer");
      yield { field, payload: bytes.subarray(at, at + length) };
      at += length;
    } else if (wire === 1 || wire === 5) {
      at += wire === 1 ? 8 : 4;
      yield { field };
    } else {
      throw new RangeError("not a protocol buffer");
    }
  }
}

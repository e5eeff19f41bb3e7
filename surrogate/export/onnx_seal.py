"""The last entry of an ONNX file's metadata, `content_sha256`: the SHA-256 sum of all bytes before it.

What is loaded is then what was exported: features, scaling, network and the sum of the weights file they come from. The
sum tells damage and change by other tools, not forgery. An ONNX file is a protocol buffer, to which an entry may be
added at the end; other programs read it as one entry more.
"""

from __future__ import annotations

import hashlib

KEY = b"content_sha256"
_METADATA_ENTRY, _KEY, _VALUE = b"\x72", b"\x0a", b"\x12"
"""Tags of the fields in `onnx.proto`: `ModelProto.metadata_props`, and key and value of a `StringStringEntryProto`."""


def sealed(content: bytes) -> bytes:
    """Return a serialised model with its sum."""
    return content + _entry(content)


def is_intact(content: bytes) -> bool:
    """Whether a file ends in the sum of its other bytes."""
    end = len(content) - len(_entry(b""))
    return end > 0 and content[end:] == _entry(content[:end])


def _entry(content: bytes) -> bytes:
    value = hashlib.sha256(content).hexdigest().encode()
    pair = b"".join(tag + bytes([len(text)]) + text for tag, text in ((_KEY, KEY), (_VALUE, value)))
    return _METADATA_ENTRY + bytes([len(pair)]) + pair

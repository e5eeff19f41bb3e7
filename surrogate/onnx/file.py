"""Format of the package's ONNX files: versions, name, metadata, inputs, output, and checksums.

The last entry of the metadata, `content_sha256`, is the SHA-256 sum of all bytes before it. It detects damage and
changes by other programs, not forgery. An ONNX file is a protocol buffer, to which entries may be appended; other
programs read the checksum as one more entry of the metadata.
"""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import onnx
    import onnxruntime

OPSET, IR_VERSION = 17, 8
"""Versions of ONNX that the ONNX Runtimes for browsers support."""

ONNX_FORMAT = "viscoelastic-contact-surrogate-onnx"
ONNX_FORMAT_VERSION = 1
ONNX_NAME = "model.onnx"

KEY = b"content_sha256"
_METADATA_ENTRY, _KEY, _VALUE = b"\x72", b"\x0a", b"\x12"
"""Tags of the fields in `onnx.proto`: `ModelProto.metadata_props`, key and value of `StringStringEntryProto`."""


def checked_content(graph: onnx.GraphProto, metadata: dict[str, str]) -> bytes:
    """Return the ONNX model of a graph with its metadata as the bytes of a file, after ONNX's own check."""
    import onnx

    opset = onnx.helper.make_opsetid("", OPSET)
    model = onnx.helper.make_model(graph, opset_imports=[opset], producer_name="contact-trajectories")
    model.ir_version = IR_VERSION
    onnx.helper.set_model_props(model, metadata)
    onnx.checker.check_model(model, full_check=True)
    return bytes(model.SerializeToString(deterministic=True))


def session_of(model_bytes: bytes, threads: int = 1) -> onnxruntime.InferenceSession:
    """Return a session of ONNX Runtime, on one thread unless more are asked for."""
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads, options.inter_op_num_threads = threads, 1
    options.log_severity_level = 4
    return onnxruntime.InferenceSession(model_bytes, options, providers=["CPUExecutionProvider"])


def sha256(path: Path) -> str:
    """Return the SHA-256 sum of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def sealed(model_bytes: bytes) -> bytes:
    """Return a serialised ONNX model with its checksum appended."""
    return model_bytes + _entry(model_bytes)


def is_intact(file_bytes: bytes) -> bool:
    """Return whether the last bytes of a file are the checksum of all others."""
    end = len(file_bytes) - len(_entry(b""))
    return end > 0 and file_bytes[end:] == _entry(file_bytes[:end])


def _entry(model_bytes: bytes) -> bytes:
    value = hashlib.sha256(model_bytes).hexdigest().encode()
    pair = b"".join(tag + bytes([len(text)]) + text for tag, text in ((_KEY, KEY), (_VALUE, value)))
    return _METADATA_ENTRY + bytes([len(pair)]) + pair

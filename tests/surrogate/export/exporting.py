"""Export of a Keras backend to a file, as training does."""

from surrogate.export.onnx import build_graph
from surrogate.network.onnx_file import sealed


def write(path, backend):
    content = build_graph(backend.model, backend.scaling, name=backend.name, architecture=backend.name)
    path.write_bytes(sealed(content.SerializeToString()))
    return path

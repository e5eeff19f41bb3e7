"""Export of a Keras network to a file, as training does."""

from surrogate.export.onnx import file_content


def write(path, network):
    path.write_bytes(file_content(network.model, network.scaling, name=network.name, architecture=network.name))
    return path

"""Networks as graphs of elementary operations: lowering from Keras, compiled streaming step, format of ONNX files."""

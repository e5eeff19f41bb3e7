"""The network as a graph of operations: ONNX file, compiled program of a streaming step."""

"""A trained network as a graph of operations: its lowering from Keras, its compiled streaming step, its ONNX file."""

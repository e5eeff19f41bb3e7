"""Trained models as ONNX files: format, features, layers of Keras, and the single step of a stream."""

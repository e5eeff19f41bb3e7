"""Trained models as ONNX files: format, features and layers of Keras."""

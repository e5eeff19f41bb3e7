"""Prediction with trained models: backends, predictor, range of validity, measured histories, streaming."""

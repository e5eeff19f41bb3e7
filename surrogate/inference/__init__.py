"""How a trained model predicts: backends, predictor, range of validity, streaming."""

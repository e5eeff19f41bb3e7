"""Prediction with trained models: one predictor, its files, its range of validity."""

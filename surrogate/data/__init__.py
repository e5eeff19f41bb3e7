"""Data of the sequence models: data set, split, input features, scaling, error metrics."""

"""What a model is given and compared with: features, scaling, data set, split, metrics."""

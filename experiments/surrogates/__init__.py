"""What the surrogates deliver and cost: errors, bands, gradients and streams."""

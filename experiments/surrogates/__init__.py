"""What the surrogates deliver and cost: errors, bands, gradients, streams, and an inverse problem."""

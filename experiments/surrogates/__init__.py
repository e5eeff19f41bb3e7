"""What the surrogates deliver and cost: errors, bands and gradients."""

"""Training of models: recipe, training loop, optimizer, checkpoint, queue, publication."""

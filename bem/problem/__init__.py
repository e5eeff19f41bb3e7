"""What a user writes: scene, materials, indenter, protocol, accuracy."""

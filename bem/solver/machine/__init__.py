"""What moves the sphere: a spring between stage and sphere, or a prescribed force."""

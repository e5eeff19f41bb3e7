"""The command `surrogate`."""

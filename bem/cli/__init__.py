"""The command `bem`."""

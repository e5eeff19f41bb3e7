"""The command line `surrogate`."""

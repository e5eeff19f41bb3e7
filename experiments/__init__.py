"""The studies of the paper and of the solver's design, each run by `python -m experiments NAME`."""

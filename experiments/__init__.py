"""The studies the paper reports and those behind the solver's design, each run by `python -m experiments.NAME`."""

"""Inputs of every figure and table, as the rules of the Makefile name them."""

import re
from functools import cache

from experiments.common import read_input
from tests.processes import ROOT, ended


@cache
def inputs_of_all():
    """Paths from the root of the repository, by the name of the figure or table."""
    arguments = ["-nB", "figures", "tables", "cost-figures", "-o", ".venv/.installed"]
    lines = ended("make", "--no-print-directory", *arguments, cwd=ROOT, check=True).stdout
    return {name: paths.split() for name, paths in re.findall(r"-m paper_figures (\S+) (.*?) --out", lines)}


def read_inputs(name):
    """Contents of the inputs of a figure or table.

    Raises:
        FileNotFoundError: One is not there.
    """
    return [read_input(ROOT / path) for path in inputs_of_all()[name]]

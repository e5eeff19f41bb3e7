"""Moved to `bem.dataset.file`; this name goes with version 0.3."""

from bem.dataset.file import load_dataset

__all__ = ["load_dataset"]

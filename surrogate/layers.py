"""Moved to `surrogate.architectures.layers`; this name goes with version 0.3."""

from surrogate.architectures.layers import AppendTabor, FiLM, TaborGate

__all__ = ["AppendTabor", "FiLM", "TaborGate"]

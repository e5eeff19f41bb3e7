"""Moved to `surrogate.architectures.layers`; this module will be removed in version 0.3."""

from surrogate.architectures.layers import AppendTabor, FiLM, TaborGate

__all__ = ["AppendTabor", "FiLM", "TaborGate"]

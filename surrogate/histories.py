"""Moved to `surrogate.inference.histories`; this name goes with version 0.3."""

from surrogate.inference.histories import predict_history

__all__ = ["predict_history"]

"""Moved to `surrogate.inference.histories`; this module will be removed in version 0.3."""

from surrogate.inference.histories import predict_history

__all__ = ["predict_history"]

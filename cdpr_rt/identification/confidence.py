"""An identified value with its confidence interval."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ConfidenceInterval:
    """value ± half_width holds the true value with 95 % confidence; both in the value's unit."""

    value: float
    half_width: float

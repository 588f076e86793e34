"""Durations as people write them."""

from __future__ import annotations


def time_text(seconds: float) -> str:
    """Return a duration: 12.34 s, 3 min 20 s, 2 h 5 min."""
    if seconds < 60.0:
        return f"{seconds:.2f} s"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min {rest} s"

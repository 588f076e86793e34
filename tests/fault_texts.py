"""Return the faults of a device as text, for assertions."""

from __future__ import annotations

from typing import Any

from cdpr_rt.core.fault import fault_text


def alarm(device: Any) -> str:
    """Return the faults of `device` as text, or ""."""
    return "; ".join(fault_text(fault, ()) for fault in device.faults())

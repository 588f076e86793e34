"""A daemon whose control loop has died: what is known of its drives, and what to do next."""

from __future__ import annotations

from typing import Any, Final

DEAD: Final = "dead"
"""The state that such a daemon reports."""


def power_text(status: dict[str, Any]) -> str:
    """Return what is known of the drives' power since the loop has died."""
    if status.get("read_only"):
        return "it only listened, and commanded no drive"
    if not status.get("driving") and not status.get("busy"):  # busy with giving or taking it
        return "its drives had been told to have no power"
    return "drives that had power stop by themselves without its heartbeat: check that they have"


def death_text(status: dict[str, Any]) -> str:
    """Return that the control loop has died, of the drives' power, and the next command."""
    return (
        f"{status['reason']}; {power_text(status)}; next: `cdpr stop` ends what is left of the "
        "daemon, then `cdpr run` starts it anew"
    )

"""Robots and a winch with long cycles, whose simulations take less time."""

from __future__ import annotations

import re
from pathlib import Path

from cdpr_profiles import load_robot
from cdpr_profiles.places import SHIPPED

PERIOD_S = 0.004
ROBOTS = ("planar-3", "planar-4", "spatial-8", "suspended-8")


def slower_robot(folder: Path, name: str | Path, period_s: float = PERIOD_S) -> Path:
    """Write a robot with longer cycles. Return its file."""
    return _slower(load_robot(name).path, folder, period_s)


def slower_winch(folder: Path, name: str, period_s: float) -> Path:
    """Write a winch with longer cycles. Return its file."""
    return _slower(SHIPPED / "winches" / f"{name}.toml", folder, period_s)


def _slower(given: Path, folder: Path, period_s: float) -> Path:
    key = "sync_period_s = "
    text, count = re.subn(rf"(?m)^{key}\S+", f"{key}{period_s}", given.read_text())
    assert count == 1
    path = folder / given.name
    path.write_text(text)
    return path


def slower_profiles(config: Path) -> None:
    """Write shipped robots and a winch with longer cycles as a user's own, which come first.

    `config` is the value of XDG_CONFIG_HOME.
    """
    own = config / "cdpr-rt" / "profiles"
    for kind, name, period_s in (
        *(("robots", name, PERIOD_S) for name in ROBOTS),
        ("winches", "winch-mpp0923d", 0.5 * PERIOD_S),  # its commissioning needs a stiffer loop
    ):
        (own / kind).mkdir(parents=True, exist_ok=True)
        _slower(SHIPPED / kind / f"{name}.toml", own / kind, period_s)

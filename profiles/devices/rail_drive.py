"""The drive of a rail on CiA 402."""

from __future__ import annotations

from pathlib import Path

from cdpr_profiles.catalogue import load_drive
from cdpr_profiles.devices.rail import Cia402Rail
from cdpr_profiles.drive import DriveProfile
from cdpr_profiles.reading.places import require


def load_rail_drive(name: str | Path, rail: Cia402Rail) -> DriveProfile:
    """Return the drive that a rail's file names, looked for beside it first; ProfileError."""
    return load_drive(rail.drive, require("rails", name).parent)

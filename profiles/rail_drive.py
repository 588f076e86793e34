"""The drive of a rail on CiA 402."""

from __future__ import annotations

from pathlib import Path

from profiles.catalogue import load_drive
from profiles.drive import DriveProfile
from profiles.rail import SHIPPED, Cia402Rail
from profiles.safety_io import find_shipped


def load_rail_drive(name: str | Path, rail: Cia402Rail) -> DriveProfile:
    """Return the drive that a rail's file names, looked for beside it first; ProfileError."""
    return load_drive(rail.drive, find_shipped(SHIPPED, name).parent)

"""Which drive profiles fit a node that was found."""

from __future__ import annotations

from pathlib import Path

from cdpr_profiles import DriveProfile, ProfileError, list_profiles, load_drive
from cdpr_profiles.reading.bounded_input import read_toml
from cdpr_tools.busview.node_reader import NodeInfo
from cdpr_tools.errors import BadInputError


def drive_profiles(folder: Path | None) -> dict[str, DriveProfile]:
    """Return the shipped drives by name, and those in a folder by path.

    Raises BadInputError for a folder that is none, ProfileError for a broken drive file.
    """
    drives = {name: load_drive(name) for name in list_profiles()["drives"]}
    if folder is None:
        return drives
    if not folder.is_dir():
        raise BadInputError(f"--profiles {folder}: is no folder")
    for path in sorted(folder.glob("*.toml")):
        if "eds" in read_toml(path):  # motors, winches and cables may lie beside the drives
            drives[str(path)] = load_drive(path)
    if not any(Path(name).parent == folder for name in drives):
        raise ProfileError(folder, "", "holds no drive profile")
    return drives


def matching_profiles(found: NodeInfo, drives: dict[str, DriveProfile]) -> list[str]:
    """Return the names of the profiles that are for a node, noting where the revision differs."""
    names = []
    for name, drive in drives.items():
        identity = (found.number(0x1018, 1), found.number(0x1018, 2))
        if identity != (drive.vendor_id, drive.product_code):
            continue
        if drive.serial is not None and drive.serial != found.number(0x1018, 4):
            continue
        revision = found.number(0x1018, 3)
        same = revision is None or revision == drive.revision
        names.append(name if same else f"{name} (but its revision is {drive.revision:08X}h)")
    return names

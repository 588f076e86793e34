"""The calibration in force of a robot's geometry: find, replace and undo it.

The calibration in force is NAME.calibration beside NAME.toml. Earlier ones are NAME.calibration.1
and so on, undone ones NAME.calibration.undone.2. Those of a shipped robot are in the user's folder.
"""

from __future__ import annotations

import glob
import re
from collections.abc import Iterator
from pathlib import Path

from cdpr_profiles.bounded_input import is_file, is_there
from cdpr_profiles.catalogue import load_robot
from cdpr_profiles.errors import ProfileError
from cdpr_profiles.geometry_calibration import (
    GeometryCalibration,
    geometry_sha256,
    write_text,
)
from cdpr_profiles.places import SHIPPED, user_folder
from cdpr_profiles.robot import Robot

_SUFFIX = ".calibration"
_BEFORE, _ALL = r"\.", r"\.(?:undone\.)?"


def calibration_file(robot: Robot) -> Path:
    """Return the path of a robot's calibration in force, whether it exists or not."""
    shipped = robot.path.parent == SHIPPED / "robots"
    folder = user_folder() / "robots" if shipped else robot.path.parent
    return folder / (robot.path.stem + _SUFFIX)


def load_calibrated(robot: str | Path) -> Robot:
    """Load a robot by name or file, with its calibration in force; raises ProfileError."""
    return calibrated(load_robot(robot))


def calibrated(robot: Robot) -> Robot:
    """Return `robot` with the calibration in force; without one, as in its file.

    Raises ProfileError if it is damaged, or was made for another state of the robot's files.
    """
    found = in_force(robot)
    if found is None:
        return robot
    _require_of(robot, found, calibration_file(robot))
    return found.applied(robot)


def in_force(robot: Robot) -> GeometryCalibration | None:
    """Return the calibration in force, even if the robot's files have changed; raises ProfileError.

    Returns None if the robot's file applies. A calibration that cannot be read, such as a link to a
    share that is not mounted, is an error: otherwise the robot would move by a wrong geometry
    unnoticed.
    """
    path = calibration_file(robot)
    if robot.platform is None or robot.is_winch or not is_there(path):
        return None
    return GeometryCalibration.load_file(path)


def next_version(robot: Robot) -> int:
    """Return the number of the next calibration of a robot; no number is used twice."""
    path = calibration_file(robot)
    known = in_force(robot)
    return max(_newest(path), 0 if known is None else known.version) + 1


def take_over(robot: Robot, found: GeometryCalibration) -> Path:
    """Put a calibration in force and keep the one before it; raises ProfileError."""
    path = calibration_file(robot)
    _require_of(robot, found, path)
    if is_there(path):
        before = GeometryCalibration.load_file(path)
        write_text(_numbered(path, before.version), before.to_toml())
    write_text(path, found.to_toml())
    return path


def undo(robot: Robot) -> GeometryCalibration | None:
    """Restore the calibration before the one in force; return it, or None for the robot's file.

    Skips calibrations made for another state of the robot's files. Raises ProfileError if none is
    in force.
    """
    path = calibration_file(robot)
    if not is_there(path):
        raise ProfileError(path, "", "no calibration is in force")
    if not is_file(path):
        raise ProfileError(path, "", "is not a file, so it cannot be undone; move it away")
    older, before = _last_before(robot, path)
    try:
        version = GeometryCalibration.load_file(path).version
    except ProfileError:  # a damaged calibration can be undone too
        version = _newest(path) + 1
    undone = path.with_name(f"{path.name}.undone.{version}")
    try:
        undone.unlink(missing_ok=True)
        undone.hardlink_to(path)  # the undone one stays in force until the other replaces it
        if older is None:
            path.unlink()
        else:
            older.replace(path)
    except OSError as error:
        raise ProfileError(path, "", f"cannot be written: {error.strerror}") from None
    return before


def _require_of(robot: Robot, found: GeometryCalibration, path: Path) -> None:
    """Raise ProfileError if a calibration does not fit the present files of this robot."""
    if found.geometry_sha256 != geometry_sha256(robot):
        raise ProfileError(
            path,
            "geometry_sha256",
            f"{robot.path}, or a file of its winches, has changed since this calibration of "
            f"{found.date:%Y-%m-%d %H:%M}; recalibrate, or use the files as they are: cdpr "
            f"calibrate undo {robot.reference}",
        )
    for key, problem in found.faults(robot):
        raise ProfileError(path, key, problem)


def _last_before(robot: Robot, path: Path) -> tuple[Path | None, GeometryCalibration | None]:
    for _, older in sorted(_versions(path, _BEFORE), reverse=True):
        try:
            found = GeometryCalibration.load_file(older)
            _require_of(robot, found, older)
        except ProfileError:
            continue
        return older, found
    return None, None


def _numbered(path: Path, number: int) -> Path:
    return path.with_name(f"{path.name}.{number}")


def _newest(path: Path) -> int:
    """Return the highest number of the stored calibrations, including undone ones; 0 if none."""
    return max((number for number, _ in _versions(path, _ALL)), default=0)


def _versions(path: Path, between: str) -> Iterator[tuple[int, Path]]:
    """Return numbers and files of the calibrations stored beside the one in force."""
    for old in path.parent.glob(glob.escape(path.name) + ".*"):
        if match := re.fullmatch(between + r"(\d+)", old.name[len(path.name) :]):
            yield int(match[1]), old

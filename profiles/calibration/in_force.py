"""Which calibration of a robot's geometry is in force: found beside its file, taken over, undone.

The one in force is NAME.calibration beside NAME.toml, those before it NAME.calibration.1 and so on;
of a shipped robot they lie in the user's own folder of robots.
"""

from __future__ import annotations

from pathlib import Path

from cdpr_profiles.calibration.geometry import (
    GeometryCalibration,
    file_sha256,
    load_geometry_calibration,
    write_text,
)
from cdpr_profiles.errors import ProfileError
from cdpr_profiles.reading.bounded_input import is_file
from cdpr_profiles.reading.places import SHIPPED, user_folder
from cdpr_profiles.robot import Robot

_SUFFIX = ".calibration"


def calibration_file(robot: Robot) -> Path:
    """Return where the calibration in force of a robot is, or would be."""
    shipped = robot.path.parent == SHIPPED / "robots"
    folder = user_folder() / "robots" if shipped else robot.path.parent
    return folder / (robot.path.stem + _SUFFIX)


def calibrated(robot: Robot) -> Robot:
    """Return `robot` with the calibration that is in force, as its file says where there is none.

    Raises ProfileError for one that is damaged, or was made for another state of the robot's file.
    """
    path = calibration_file(robot)
    if robot.platform is None or robot.is_winch or not is_file(path):
        return robot
    found = load_geometry_calibration(path)
    if found.robot_sha256 != file_sha256(robot.path):
        raise ProfileError(
            path,
            "robot_sha256",
            f"{robot.path} has been changed since this calibration of {found.date:%Y-%m-%d %H:%M};"
            " allowed: calibrate anew, or take the file as it is: cdpr calibrate undo "
            f"{robot.reference}",
        )
    for key, problem in found.faults(robot):
        raise ProfileError(path, key, problem)
    return found.applied(robot)


def next_version(robot: Robot) -> int:
    """Return the number that the next calibration of a robot has."""
    path = calibration_file(robot)
    numbers = [_number(old) for old in path.parent.glob(path.name + ".*")] + [0]
    if is_file(path):
        numbers.append(load_geometry_calibration(path).version)
    return max(numbers) + 1


def take_over(robot: Robot, found: GeometryCalibration) -> Path:
    """Put a calibration in force and keep the one before it; raises ProfileError."""
    for key, problem in found.faults(robot):
        raise ProfileError(robot.path, key, problem)
    path = calibration_file(robot)
    if is_file(path):
        before = load_geometry_calibration(path)
        write_text(_numbered(path, before.version), before.to_toml())
    write_text(path, found.to_toml())
    return path


def undo(robot: Robot) -> GeometryCalibration | None:
    """Put the calibration before the one in force back; return it, None for the robot's file.

    Raises ProfileError where none is in force.
    """
    path = calibration_file(robot)
    if not is_file(path):
        raise ProfileError(path, "", "there is no calibration in force, so none to undo")
    older = sorted((_number(p), p) for p in path.parent.glob(path.name + ".*") if _number(p))
    try:
        path.replace(path.with_name(path.name + ".undone"))
        if not older:
            return None
        older[-1][1].replace(path)
    except OSError as error:
        raise ProfileError(path, "", f"cannot be written: {error.strerror}") from None
    return load_geometry_calibration(path)


def _numbered(path: Path, number: int) -> Path:
    return path.with_name(f"{path.name}.{number}")


def _number(path: Path) -> int:
    end = path.name.rpartition(".")[2]
    return int(end) if end.isdigit() else 0

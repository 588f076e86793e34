"""What commissioning has learnt of a robot's motors: found, checked, ready for the control."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from cdpr_rt.cogging_profile import CoggingProfile, CoggingProfileError
from cdpr_rt.compensation import AxisCompensation
from drivers.boot import BootReport
from profiles import Robot, RobotAxis
from tools.commissioning import Paths
from tools.errors import BadInputError
from tools.session import identity_of

CoggingProfiles = tuple[CoggingProfile | None, ...]
"""One for each axis of a robot, None where its motor has not been commissioned."""


def folder_of(axis: RobotAxis) -> str:
    """Return the name of the folder of an axis in that of its robot's commissioning."""
    return folder_called(axis.name, axis.node_id)


def folder_called(name: str, node_id: int) -> str:
    """Return the name of the folder of an axis with this name at this node."""
    return re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-") or f"node-{node_id}"


def with_commissioned(robot: Robot, folder: Path | None) -> Robot:
    """Return `robot` with the profiles that lie in `folder`, a subfolder for each axis.

    Axes without one there keep what the robot's file says; None leaves all as they are. Raises
    BadInputError for a folder that holds none at all.
    """
    if folder is None:
        return robot
    found = {i: folder / folder_of(axis) for i, axis in enumerate(robot.axes)}
    found = {i: path.resolve() for i, path in found.items() if Paths(path).profile.is_file()}
    if not found:
        subfolders = ", ".join(folder_of(axis) for axis in robot.axes)
        raise BadInputError(
            f"--commissioned {folder}: no {Paths(folder).profile.name} in a subfolder of an axis "
            f"of {robot.name}; allowed: what `cdpr commission {robot.profile}` has left, in "
            f"{subfolders}"
        )
    return _with_paths(robot, {i: found.get(i, a.commissioned) for i, a in enumerate(robot.axes)})


def without_commissioned(robot: Robot) -> Robot:
    """Return `robot` as if no motor had been commissioned."""
    return _with_paths(robot, {})


def _with_paths(robot: Robot, paths: Mapping[int, Path | None]) -> Robot:
    axes = (replace(axis, commissioned=paths.get(i)) for i, axis in enumerate(robot.axes))
    return replace(robot, axes=tuple(axes))


def load_profiles(robot: Robot) -> CoggingProfiles:
    """Return the cogging profiles that the axes name.

    Raises BadInputError, naming axis and file, for one that cannot be read or is of another motor.
    """
    return tuple(_load(axis) for axis in robot.axes)


def _load(axis: RobotAxis) -> CoggingProfile | None:
    path = axis.commissioned
    if path is None:
        return None
    path = Paths(path).profile if path.is_dir() else path
    try:
        profile = CoggingProfile.load(path)
    except CoggingProfileError as error:
        raise BadInputError(f"axis {axis.name}: {error}") from error
    motor = axis.winch.motor.model
    if profile.motor != motor:
        raise BadInputError(
            f"axis {axis.name}: {path}: motor = {profile.motor}; allowed: {motor}, which its winch "
            "has"
        )
    return profile


def compensation_of(
    profiles: Sequence[CoggingProfile | None],
) -> tuple[AxisCompensation | None, ...]:
    """Return what the control compensates of each motor: the harmonic model and its friction."""
    return tuple(None if p is None else p.better.compensation() for p in profiles)


def refuse_strangers(
    robot: Robot, profiles: Sequence[CoggingProfile | None], reports: Mapping[int, BootReport]
) -> None:
    """Raise CoggingProfileError, naming the axis, where a profile is of another drive.

    `reports` are those of the axes that have booted, by their numbers.
    """
    for i, report in reports.items():
        profile, axis = profiles[i], robot.axes[i]
        if profile is None:
            continue
        try:
            profile.compensation("better", identity_of(report), axis.winch.motor.model)
        except CoggingProfileError as error:
            raise CoggingProfileError(f"axis {axis.name}: {axis.commissioned}: {error}") from error

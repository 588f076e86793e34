"""Find and check the commissioning results of a robot's motors, and prepare them for control."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from cdpr_drivers.canopen.boot import BootReport
from cdpr_drivers.errors import ConfigurationError
from cdpr_profiles import Robot, RobotAxis
from cdpr_profiles.motor_bounds import MotorBounds
from cdpr_rt.control.compensation import AxisCompensation
from cdpr_rt.core.supervisor import Limits
from cdpr_rt.identification.cogging_profile import (
    CoggingProfile,
    CoggingProfileError,
    DriveIdentity,
)
from cdpr_rt.identification.commissioning_results import Paths
from cdpr_rt.model.robot_arrays import limits_of

CoggingProfiles = tuple[CoggingProfile | None, ...]
"""Profile of each axis of a robot; None if its motor has not been commissioned."""


def identity_of(report: BootReport) -> DriveIdentity:
    """Return the identity of a booted drive to which a cogging profile is bound."""
    return DriveIdentity(
        vendor_id=report.vendor_id,
        product_code=report.product_code,
        revision=report.revision,
        serial=report.serial,
        encoder_counts_per_turn=report.counts_per_turn,
    )


def folder_of(axis: RobotAxis) -> str:
    """Return the name of an axis' folder within the folder of its robot's commissioning."""
    return folder_called(axis.name, axis.node_id)


def folder_called(name: str, node_id: int) -> str:
    """Return the name of the folder of an axis with this name at this node."""
    return re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-") or f"node-{node_id}"


def with_commissioned(robot: Robot, folder: Path | None) -> Robot:
    """Return `robot` with the profiles found in `folder`, which has a subfolder for each axis.

    Axes without a profile there keep the profile of the robot's file. If `folder` is None, all axes
    keep it. Raises ConfigurationError for a folder without any profile.
    """
    if folder is None:
        return robot
    found = {i: folder / folder_of(axis) for i, axis in enumerate(robot.axes)}
    # a path that exists but is not a file counts as found: reading it reports the error
    there = {i: path for i, path in found.items() if os.path.lexists(Paths(path).profile)}
    found = {i: path.resolve() for i, path in there.items()}
    if not found:
        subfolders = ", ".join(folder_of(axis) for axis in robot.axes)
        raise ConfigurationError(
            f"--commissioned {folder}: no {Paths(folder).profile.name} in a subfolder of an axis "
            f"of {robot.name}; allowed: the results of `cdpr commission {robot.profile}`, "
            f"in {subfolders}"
        )
    return _with_paths(robot, {i: found.get(i, a.commissioned) for i, a in enumerate(robot.axes)})


def uncommissioned_text(robot: Robot) -> str:
    """Return which axes lack a profile although others have one; empty if all or none have one."""
    names = [axis.name for axis in robot.axes if axis.commissioned is None]
    if len(names) in (0, len(robot.axes)):
        return ""
    return f"not commissioned, so not compensated: {', '.join(names)}"


def without_commissioned(robot: Robot) -> Robot:
    """Return `robot` with all commissioning profiles removed."""
    return _with_paths(robot, {})


def _with_paths(robot: Robot, paths: Mapping[int, Path | None]) -> Robot:
    axes = (replace(axis, commissioned=paths.get(i)) for i, axis in enumerate(robot.axes))
    return replace(robot, axes=tuple(axes))


def load_profiles(robot: Robot, limits: Limits | None = None) -> CoggingProfiles:
    """Return the cogging profiles that the axes name.

    They are checked against the torques of `limits` (default: those of the robot's file).

    Raises ConfigurationError, naming axis and file, for a profile that cannot be read, belongs to
    another motor or has values that this motor cannot have.
    """
    found = tuple(map(_load, robot.axes, _bounds(robot, limits)))
    lengths = {len(one.harmonic.table_Nm[0]): i for i, one in enumerate(found) if one is not None}
    if len(lengths) > 1:
        paths = " and ".join(f"{robot.axes[i].commissioned}" for i in lengths.values())
        raise ConfigurationError(
            f"{paths}: harmonic.table_Nm has {' and '.join(map(str, lengths))} values; "
            "every axis needs the same number"
        )
    return found


def _bounds(robot: Robot, limits: Limits | None = None) -> list[MotorBounds]:
    limits = limits or limits_of(robot)
    torques = np.broadcast_to(limits.torque_Nm, (len(robot.axes),)).tolist()
    return [MotorBounds(axis.winch.motor, t) for axis, t in zip(robot.axes, torques, strict=True)]


def _load(axis: RobotAxis, bounds: MotorBounds) -> CoggingProfile | None:
    path = axis.commissioned
    if path is None:
        return None
    path = Paths(path).profile if path.is_dir() else path
    return load_profile(path, bounds, f"axis {axis.name}: ")


def load_profile(path: Path, bounds: MotorBounds, whose: str = "") -> CoggingProfile:
    """Return the cogging profile of a motor; raises ConfigurationError, which begins with `whose`.

    The error names the file, the key and the value that is impossible for this motor.
    """
    try:
        profile = CoggingProfile.load(path)
    except CoggingProfileError as error:
        raise ConfigurationError(f"{whose}{error}") from error
    try:
        profile.require_true_of(bounds)
    except CoggingProfileError as error:
        raise ConfigurationError(f"{whose}{path}: {error}") from error
    return profile


def compensation_of(
    robot: Robot, profiles: Sequence[CoggingProfile | None], limits: Limits | None = None
) -> tuple[AxisCompensation | None, ...]:
    """Return the compensation of each motor: its harmonic model and its friction.

    Torques stay within `limits` (default: those of the robot's file).
    """
    pairs = zip(profiles, _bounds(robot, limits), strict=True)
    return tuple(None if p is None else p.harmonic.compensation(bounds) for p, bounds in pairs)


def check_drive_identities(
    robot: Robot, profiles: Sequence[CoggingProfile | None], reports: Sequence[BootReport]
) -> None:
    """Raise CoggingProfileError, naming the axis, if a profile belongs to another drive.

    Raise ConfigurationError if a winch's calibration belongs to another drive, because it contains
    that drive's torque constant. Drives without a serial number (0) cannot be checked.
    """
    bounds = _bounds(robot)
    for i, report in enumerate(reports):
        profile, axis = profiles[i], robot.axes[i]
        of = 0 if axis.calibration is None else axis.calibration.drive_serial
        if of and report.serial not in (0, of):
            raise ConfigurationError(
                f"{robot.path}: axes[{i}].calibration: is for a drive with serial {of}, but "
                f"that of axis {axis.name} has {report.serial}; calibrate it again"
            )
        if profile is None:
            continue
        try:
            profile.compensation("harmonic", identity_of(report), bounds[i])
        except CoggingProfileError as error:
            raise CoggingProfileError(f"axis {axis.name}: {axis.commissioned}: {error}") from error

"""Robots for tests of predictions and findings."""

from __future__ import annotations

import dataclasses
from typing import TypeVar

from cdpr_profiles import Robot
from cdpr_profiles.platform import Platform
from tests.cdpr_rt.platform.platform_physics import Machine

_Robot = TypeVar("_Robot", Robot, Machine)


def with_cables(robot: _Robot, **update: float) -> _Robot:
    """Return a robot with changed values in the profiles of its cables."""
    axes = []
    for axis in robot.axes:
        cable = axis.winch.cable.model_copy(update=update)
        axes.append(dataclasses.replace(axis, winch=dataclasses.replace(axis.winch, cable=cable)))
    return dataclasses.replace(robot, axes=tuple(axes))


def hung(exits: tuple[tuple[float, ...], ...], anchors: tuple[tuple[float, ...], ...]) -> Platform:
    size = len(exits[0])
    return Platform(
        mass_kg=2.0,
        home_m=(0.0,) * size,
        home_tolerance_m=0.05,
        workspace_min_m=(-0.5,) * size,
        workspace_max_m=(0.5,) * size,
        speed_m_s=0.5,
        acceleration_m_s2=1.0,
        exit_points_m=exits,
        anchor_points_m=anchors,
    )

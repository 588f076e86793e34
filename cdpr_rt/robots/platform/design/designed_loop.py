"""The loop of a robot file, designed once, and what it keeps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np

from cdpr_profiles import RobotAxis
from cdpr_profiles.platform import Platform
from cdpr_rt.robots.platform.design.loop_cycle import Mode
from cdpr_rt.robots.platform.design.loop_design import LoopModel
from cdpr_rt.robots.platform.design.loop_gains import LoopGains, LoopMargins
from cdpr_rt.robots.platform.design.loop_plant import LITTLE_DAMPING_s
from cdpr_rt.robots.platform_model import PlatformModel


@dataclass(frozen=True)
class _Robot:
    """What a loop is designed from; that of one robot is designed once."""

    platform: Platform
    bounds_N: tuple[tuple[float, ...], ...]
    """Of the tensions, which turn the platform: least, greatest; what is kept from them."""
    rotors_kg: tuple[float, ...]
    stiffness_N: tuple[float, ...]
    cable_damping_s: float
    period_s: float
    model: PlatformModel = field(compare=False)


class _Judged(NamedTuple):
    margins: list[LoopMargins]
    modes: tuple[Mode, ...]
    growing: tuple[Mode, ...]


@dataclass(frozen=True)
class DesignedLoop:
    """The loop of a robot, and what it keeps at each of `design_poses`."""

    gains: LoopGains
    _robot: _Robot = field(repr=False)

    @property
    def margins(self) -> list[LoopMargins]:
        """Its margins there."""
        return self._judged.margins

    @property
    def modes(self) -> tuple[Mode, ...]:
        """The least damped mode of robot and loop there."""
        return self._judged.modes

    @property
    def growing_modes(self) -> tuple[Mode, ...]:
        """These modes if cables damped by LITTLE_DAMPING_s.

        None where no mode grows then, or they do damp no more.
        """
        return self._judged.growing

    @property
    def slowest_rad_s(self) -> float:
        """Of the platform's modes in closed loop, at all poses."""
        return min(there.slowest_rad_s for there in self.margins)

    @cached_property
    def _judged(self) -> _Judged:
        """What only people are told. The `LoopModel` is made anew, and its megabytes go again."""
        loop, gains, damping_s = _loop_model(self._robot), self.gains, self._robot.cable_damping_s
        calm = damping_s <= LITTLE_DAMPING_s or loop.dies_down(gains, LITTLE_DAMPING_s)
        growing = () if calm else loop.least_damped(gains, LITTLE_DAMPING_s)
        return _Judged(loop.margins(gains), loop.least_damped(gains, damping_s), growing)


def designed_loop(model: PlatformModel, axes: Sequence[RobotAxis], period_s: float) -> DesignedLoop:
    """Return the loop of a robot with these axes, one for each of the n cables.

    Raises GeometryError where the cables do not hold the platform, UnstableError where no loop
    does.
    """
    return _designed(_robot(model, axes, period_s))


def _robot(model: PlatformModel, axes: Sequence[RobotAxis], period_s: float) -> _Robot:
    winches = [axis.winch for axis in axes]
    rotors_kg = [w.motor.rotor_inertia_kg_m2 / w.cable_m_per_motor_rad**2 for w in winches]
    stiffness_N = [w.cable.stiffness_N for w in winches]
    damping_s = min(w.cable.damping_s for w in winches)
    bounds_N = tuple(model.low_N.tolist()), tuple(model.high_N.tolist()), (model.reserve_N,)
    known = bounds_N, tuple(rotors_kg), tuple(stiffness_N), damping_s, period_s
    return _Robot(model.platform, *known, model)


def _loop_model(robot: _Robot) -> LoopModel:
    rotors_kg, stiffness_N = np.array(robot.rotors_kg), np.array(robot.stiffness_N)
    damping_s = robot.cable_damping_s
    return LoopModel(robot.model, rotors_kg, stiffness_N, robot.period_s, cable_damping_s=damping_s)


@lru_cache(maxsize=4)
def _designed(robot: _Robot) -> DesignedLoop:
    return DesignedLoop(_loop_model(robot).design(), robot)

"""Criterion by which a place belongs to a workspace."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from cdpr_profiles import Robot
from cdpr_profiles.platform import Platform
from cdpr_rt.arrays import FloatArray
from cdpr_rt.robots.platform_model import platform_model, platform_model_of
from cdpr_rt.robots.rigid_body import orientations
from cdpr_rt.robots.statics import PlatformStatics


@dataclass(frozen=True)
class Criterion:
    """The cables hold the platform at a place, at every one of some orientations.

    All tensions carry the weight, with accelerations up to `acceleration_m_s2` and as much of the
    angular one of the robot's file, and keep at least `least_N` from their bounds. At 0 m/s2 that
    is the static workspace, else the wrench-feasible one; at one orientation the workspace of
    constant orientation, at several the total orientation workspace of these. Other processes can
    be given it.
    """

    platform: Platform
    low_N: tuple[float, ...]
    high_N: tuple[float, ...]
    acceleration_m_s2: float
    turns_rad: tuple[tuple[float, ...], ...] = ((0.0, 0.0, 0.0),)
    """Rotation vectors from home's orientation."""
    least_N: float = 0.0
    contact_free: bool = False
    """Whether a place has to be reached straight from the centre without contact, too: cables,
    body and obstacles keep the clearance of the robot's file at each of the orientations."""

    def depths(self, points: FloatArray) -> FloatArray:
        """Return how far places (m, k) are inside, N, (m,): the margin less `least_N`.

        Of the worst orientation; below zero outside, -inf where no tensions hold some direction.
        Nothing of contact.
        """
        statics = self._statics
        workspace = statics.model.workspace(self.acceleration_m_s2, 0.0)
        found = [
            workspace.capacity_margins(statics.poses(points, np.array(turn)))
            for turn in self.turns_rad
        ]
        return np.asarray(np.min(found, axis=0) - self.least_N)

    def clear_shares(self, centre_m: FloatArray, ends_m: FloatArray) -> FloatArray:
        """Return the shares (m,) of straight ways from a centre to places that are free of contact.

        At constant orientation, of the worst one; 0 where something is in contact at the centre.
        Two cables that meet pass through each other within millimetres: places alone, however
        close, would not tell on which side they are.
        """
        shares = np.ones(len(ends_m))
        model = self._statics.model
        if not self.contact_free or not len(model.interference.pairs):
            return shares
        chosen = [i - 3 for i in model.kinematics.directions if i >= 3]
        for turn in np.array(self.turns_rad):
            start = np.concatenate([centre_m, turn[chosen]])
            if model.interference.contact(model.pose(start).array):
                return np.zeros(len(ends_m))
            way = np.array([start, start])
            for k, end in enumerate(ends_m):
                way[1, : len(end)] = centre_m + shares[k] * (end - centre_m)
                met = model.interference.first_contact(way)
                shares[k] *= met.share if met else 1.0
        return shares

    @property
    def _statics(self) -> PlatformStatics:
        return _statics(self.platform, self.low_N, self.high_N)


def criterion_of(
    robot: Robot,
    acceleration_m_s2: float,
    turns_rad: FloatArray,
    least_N: float,
    contact_free: bool = False,
) -> Criterion:
    """Return the criterion of a robot that has a platform, within its limits."""
    assert robot.platform is not None
    model = platform_model_of(robot)
    low, high = tuple(model.low_N.tolist()), tuple(model.torque_limited_N.tolist())
    turns = tuple(tuple(turn) for turn in np.asarray(turns_rad).tolist())
    return Criterion(robot.platform, low, high, acceleration_m_s2, turns, least_N, contact_free)


def turns_within(platform: Platform, angle_rad: float) -> FloatArray:
    """Return rotation vectors (k, 3) that stand for all up to an angle from home's orientation.

    None; then those of the angle and of half of it, about each controlled axis and the diagonals.
    """
    whole = orientations(replace(platform, workspace_angle_rad=angle_rad))
    return np.concatenate([whole, 0.5 * whole[1:]])


@lru_cache(maxsize=4)
def _statics(
    platform: Platform, low_N: tuple[float, ...], high_N: tuple[float, ...]
) -> PlatformStatics:
    return PlatformStatics(platform_model(platform, np.array(low_N), np.array(high_N)))

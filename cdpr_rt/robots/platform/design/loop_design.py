"""Design of a platform's loop from its rotors, cables, delays and mass, and its margins.

The plant is that of `loop_plant`: x = -G τ, with the rotors' x as paid-out cable, and the loop
makes of x, late, the motors' pull τ = C(s) x. How far the eigenvalues of the return difference are
from 0 is told by the largest singular value of the sensitivity (1 + C G)^-1: its inverse, the
modulus margin μ, is a gain margin of at least 1/(1 - μ) and a phase margin of at least 2 asin(μ/2)
(Skogestad and Postlethwaite, Multivariable Feedback Control, 2.4.3).

Tensions that are planned where the platform is follow its pose: they take the geometric stiffness
K_G away that they give it, late, L(s) being what of x comes through, and G' = (1 - G L K_G)^-1 G.
Where cables' elasticity is not much more than that, they are planned at the set-point in place of
it, and what turns the platform away meets K_G.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from cdpr_profiles import RobotAxis
from cdpr_profiles.platform import Platform
from cdpr_rt.arrays import FloatArray
from cdpr_rt.errors import GeometryError
from cdpr_rt.robots.platform.design.loop_cycle import Mode, cycle_matrix, least_damped
from cdpr_rt.robots.platform.design.loop_gains import (
    DAMPING_RATIO,
    LoopGains,
    LoopMargins,
    OBSERVER_rad_s,
    latency_s,
)
from cdpr_rt.robots.platform.design.loop_plant import BETWEEN, GREATEST, LEAST, NONE, linear_plant
from cdpr_rt.robots.platform.design.margin_kernel import keeps_margin
from cdpr_rt.robots.platform_model import PlatformModel

ComplexArray = NDArray[np.complex128]

LEAST_MARGIN = 0.45
"""Modulus margin that the design keeps, with all stiffness in STIFFNESS_SHARES."""
FOLLOWED_MARGIN = 0.4
"""What a loop that is designed without tensions has to keep with those that follow the pose."""
STIFFNESS_SHARES = (0.7, 1.0, 1.3)
_SMOOTHERS_Hz = ((0.0, 25.0), (0.55, 25.0), (0.55, 12.0), (0.8, 12.0), (0.8, 8.0), (0.9, 12.0))
"""Shares of smooth velocity that are tried, each with the frequency of its low-pass."""
_ROTOR_SHARES = (1.6, 0.8, 0.4)
_LOOSE_SHARE = 0.075
_INTEGRAL_RATE_1_s = 5.0
_INTEGRAL_SHARES = (0.3, 0.15)
"""Rates of the integral part that are tried, over 2 ζ ω of the slowest mode."""
_SLOWEST_rad_s, _FASTEST_rad_s = 1.0, 80.0
_TURNED_AWAY_SHARE = 0.5
"""Of the loop's stiffness, the most that tensions may take from the slowest that is tried."""
_STEP, _REFINEMENTS = 1.3, 3
_LOW_Hz, _HIGHEST_Hz, _FREQUENCIES = 0.3, 150.0, 64
_LOWEST_Hz, _BELOW = 0.02, 12
"""Below the slowest modes: tensions that follow a softer platform may make it drift away."""


class UnstableError(GeometryError):
    """A robot that no loop holds."""


class SwingsError(UnstableError):
    """A robot with a mode that each loop drives to swing."""


def design_poses(model: PlatformModel) -> FloatArray:
    """Return the set-points (m, d) at which a loop is designed and judged.

    Home, the middle, the corners of the box, and the middle turned about each axis to and fro.
    """
    platform = model.platform
    k, d = model.positions, model.size
    low, high = np.array(platform.workspace_min_m), np.array(platform.workspace_max_m)
    middle = np.concatenate([0.5 * (low + high), np.zeros(d - k)])
    found = [model.home, middle]
    for corner in itertools.product(*zip(low, high, strict=True)):
        found.append(np.concatenate([corner, np.zeros(d - k)]))
    if platform.workspace_angle_rad > 0.0:
        for i in range(k, d):
            for sign in (-1.0, 1.0):
                found.append(middle + sign * platform.workspace_angle_rad * np.eye(d)[i])
    return np.array(found)


class LoopModel:
    """The linear model of a robot around some poses, for loops to be designed and judged with."""

    def __init__(
        self,
        model: PlatformModel,
        rotors_kg: FloatArray,
        stiffness_N: FloatArray,
        period_s: float,
        poses: FloatArray | None = None,
    ) -> None:
        """Take rotors' masses (n,) as the cables feel them, EA (n,), and set-points (m, d).

        Raises GeometryError where the cables do not hold the platform at one of them.
        """
        self.period_s, self.rotor_kg = period_s, float(rotors_kg.mean())
        self._positions = model.positions
        self._lightest_kg = float(rotors_kg.min())
        self.poses = design_poses(model) if poses is None else poses
        highest = min(_HIGHEST_Hz, 0.3 / period_s)
        below = np.geomspace(_LOWEST_Hz, _LOW_Hz, _BELOW, endpoint=False)
        self.frequency_Hz = np.append(below, np.geomspace(_LOW_Hz, highest, _FREQUENCIES))
        self._s = s = (2j * np.pi * self.frequency_Hz).astype(np.complex128)
        self._late = np.exp(-s * latency_s(period_s)) / (1.0 + s / OBSERVER_rad_s) ** 2
        self._rotors_kg, self._hardest = rotors_kg, 0
        self._swings: Mode | None = None
        self._linear = [
            linear_plant(model, q, rotors_kg, stiffness_N, self._s, STIFFNESS_SHARES)
            for q in self.poses
        ]
        self._mass_kg = np.array([plant.mass_kg for plant in self._linear])
        self._geometric_N_m = np.array([plant.geometric_N_m for plant in self._linear])
        G = np.array([plant.response_m_N for plant in self._linear])
        fed = self._late[:, None, None] * self._geometric_N_m[:, 1:, None, None]
        followed = np.linalg.solve(np.eye(model.size) - G[:, 1:] @ fed, G[:, 1:])
        shape = (len(self.poses), -1, len(s), model.size, model.size)
        self._elastic = G[:, NONE]
        self._planned = G[:, [LEAST, GREATEST]].reshape(shape)
        self._followed = followed.reshape(shape)

    def margins(self, gains: LoopGains) -> list[LoopMargins]:
        """Return the margins of a loop at each of the poses."""
        damping, stiffness, _ = self._along_modes(gains)
        of_speed, of_place = self._factors(gains)
        C = (
            of_speed[:, None] * damping[:, None, None]
            + of_place[:, None] * stiffness[:, None, None]
        )
        difference = np.eye(C.shape[-1]) + C[..., None] * self._plants(gains)
        least = np.linalg.svd(difference, compute_uv=False)[..., -1].min(axis=1)
        return [
            LoopMargins(
                float(at.min()),
                float(self.frequency_Hz[at.argmin()]),
                float(omega.min()),
                float(omega.max()),
            )
            for at, omega in zip(least, self._modes_rad_s(gains), strict=True)
        ]

    def least_damped(self, gains: LoopGains) -> list[Mode]:
        """Return the least damped mode of a cycle of robot and loop at each of the poses."""
        return [self._least_damped(gains, i) for i in range(len(self.poses))]

    def _least_damped(self, gains: LoopGains, i: int) -> Mode:
        damping, stiffness, _ = self._along_modes(gains)
        plant, law = self._linear[i], (gains, damping[i], stiffness[i], self.period_s)
        cycles = [
            cycle_matrix(plant, share, plant.geometric_N_m[level], self._rotors_kg, *law)
            for share in STIFFNESS_SHARES
            for level in (LEAST, BETWEEN, GREATEST)
        ]
        return least_damped(np.array(cycles), self.period_s)

    def _dies_down(self, gains: LoopGains) -> bool:
        """Return whether all modes do at all poses, the one first where one did not before."""
        for i in sorted(range(len(self.poses)), key=lambda i: i != self._hardest):
            if (mode := self._least_damped(gains, i)).damping_ratio <= 0.0:
                self._hardest, self._swings = i, mode
                return False
        return True

    def _plants(self, gains: LoopGains) -> ComplexArray:
        return self._followed if gains.follows_pose else self._planned

    def _modes_rad_s(self, gains: LoopGains) -> FloatArray:
        """Return the platform's modes in closed loop, without delays, (m, d)."""
        _, _, omega = self._along_modes(gains)
        if gains.follows_pose:
            return omega
        root = (self._mass_kg + gains.rotor_kg) ** -0.5
        squares = root[..., None] * self._geometric_N_m[:, LEAST] * root[:, None]
        squares = squares + (omega**2)[..., None] * np.eye(omega.shape[1])
        return np.asarray(np.sqrt(np.linalg.eigvalsh(squares)))

    def _along_modes(self, gains: LoopGains) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the loop's damping and stiffness, and the platform's ω, of each mode (m, d)."""
        mass, ratio = self._mass_kg + gains.rotor_kg, DAMPING_RATIO
        inertial = 2.0 * ratio * gains.bandwidth_rad_s * mass
        damping = 1.0 / (1.0 / inertial + 1.0 / gains.damping_N_s_m)
        omega = damping / (2.0 * ratio * mass)
        return damping, omega**2 * mass, omega

    def _factors(self, gains: LoopGains) -> tuple[ComplexArray, ComplexArray]:
        """Return by what damping and stiffness count in C(s), latency included, (frequencies,)."""
        s = self._s
        lowpassed = 1.0 / (1.0 + s / gains.smoother_rad_s) ** 2
        of_speed = self._late * s * (1.0 - gains.smooth + gains.smooth * lowpassed)
        return of_speed, self._late * (1.0 + gains.integral_1_s / s)

    def _keeps(self, gains: LoopGains, plants: ComplexArray, least: float = LEAST_MARGIN) -> bool:
        damping, stiffness, _ = self._along_modes(gains)
        scratch = np.zeros((2, *plants.shape[-2:]), complex)
        factors = self._factors(gains)
        return keeps_margin(plants, *factors, damping, stiffness, least, scratch)

    def design(self) -> LoopGains:
        """Return the loop that overcomes friction the soonest of those that keep LEAST_MARGIN.

        They keep it at all poses, with all stiffness. Dry friction in the winches, about the same
        in each, is what keeps a platform from its target, and the integral part what overcomes it:
        in N/(m s) of cable, in the geometric mean over the modes.

        It is designed for elastic cables, and judged with tensions that follow the pose, from none
        on to the greatest that may be planned. Where that takes too much of its margin it is
        designed anew, for tensions of the set-point; and where none is stiff enough for those that
        turn the platform away, for some that follow. In a cycle of robot and loop all modes die
        down. Raises UnstableError where none holds it then, SwingsError where modes would not.
        """
        turning, late_s = self._geometric_N_m, latency_s(self.period_s) + 2.0 / OBSERVER_rad_s
        elastic = self._best(self._elastic, np.zeros_like(turning), follows_pose=True)
        keeps = elastic is not None and self._keeps(elastic, self._followed, FOLLOWED_MARGIN)
        if elastic and keeps and self._dies_down(elastic):
            return elastic
        self._swings = None  # what that loop drives says nothing of those that are designed now
        # followed late, it takes of the damping what it would have taken of the stiffness
        best = self._held(self._planned, turning, follows_pose=False) or self._held(
            self._followed, late_s * turning, follows_pose=True
        )
        if best is not None:
            return best
        if self._swings is None:
            raise UnstableError(
                "its tensions turn the platform away faster than a loop can hold it"
            )
        q = [f"{x:.2f}" for x in self.poses[self._hardest]]
        place, turn = ", ".join(q[: self._positions]), ", ".join(q[self._positions :])
        raise SwingsError(
            f"whatever its gains, the loop drives a mode at {self._swings.frequency_Hz:.3g} Hz to "
            f"swing where the platform is at ({place}) m"
            + (f", turned by ({turn}) rad" if turn else "")
        )

    def _held(
        self, plants: ComplexArray, turning: FloatArray, *, follows_pose: bool
    ) -> LoopGains | None:
        """Return the best loop all of whose modes die down, None where none holds the platform."""
        for calmed in (False, True):
            best = self._best(plants, turning, follows_pose=follows_pose, calmed=calmed)
            if best is None or not self._keeps(best, plants, FOLLOWED_MARGIN):
                return None
            if self._dies_down(best):
                return best
        return None

    def _best(
        self,
        plants: ComplexArray,
        turning: FloatArray,
        *,
        follows_pose: bool,
        calmed: bool = False,
    ) -> LoopGains | None:
        best, soonest = None, 0.0
        tried = itertools.product(_SMOOTHERS_Hz, _ROTOR_SHARES, _INTEGRAL_SHARES)
        for (smooth, smoother_Hz), share, integral in tried:
            slow = self._slow(smooth, 2.0 * math.pi * smoother_Hz, share, integral)
            gains = self._slowest(replace(slow, follows_pose=follows_pose), plants, turning)
            if gains is None:
                continue
            at_most = self._integral_N_m_s(self._with(gains, math.inf))
            if best is None or at_most > soonest:
                quickest = self._quickest(gains, plants)
                found: LoopGains | None = quickest
                if calmed and self._integral_N_m_s(quickest) > soonest:
                    found = self._calmed(quickest, gains.bandwidth_rad_s)
                if found and (integral := self._integral_N_m_s(found)) > soonest:
                    best, soonest = found, integral
        return best

    def _calmed(self, gains: LoopGains, slowest_rad_s: float) -> LoopGains | None:
        """Return the loop slowed down until all its modes die down, None where they never do."""
        while not self._dies_down(gains):
            gains = self._with(gains, gains.bandwidth_rad_s / _STEP)
            if gains.bandwidth_rad_s < slowest_rad_s:
                return None
        return gains

    def _slow(
        self, smooth: float, smoother_rad_s: float, share: float, integral_share: float
    ) -> LoopGains:
        """Return the slowest loop with this part of smooth velocity, and of a rotor's damping."""
        late_s = latency_s(self.period_s) + 2.0 / OBSERVER_rad_s
        most = self._lightest_kg / late_s / (1.0 - smooth)
        loose = _LOOSE_SHARE * most
        gains = LoopGains(
            0.0, share * most, smooth, smoother_rad_s, loose, integral_share, 0.0, self.rotor_kg
        )
        return self._with(gains, _SLOWEST_rad_s)

    def _slowest(
        self, gains: LoopGains, plants: ComplexArray, turning: FloatArray
    ) -> LoopGains | None:
        """Return the slowest loop from these gains on that holds the platform.

        Where tensions turn it away, as those of crossed cables, by what is `turning` (..., d, d),
        in N/m, or where they follow its pose N s/m, one that does more, and keeps LEAST_MARGIN;
        None where none does.
        """
        if self._holds(gains, turning):
            return gains
        while gains.bandwidth_rad_s < _FASTEST_rad_s:
            gains = self._with(gains, gains.bandwidth_rad_s * _STEP)
            if self._holds(gains, turning) and self._keeps(gains, plants):
                return gains
        return None

    def _holds(self, gains: LoopGains, turning: FloatArray) -> bool:
        damping, stiffness, _ = self._along_modes(gains)
        root = (damping if gains.follows_pose else stiffness)[:, None] ** -0.5
        shares = root[..., None] * turning * root[..., None, :]
        return float(np.linalg.eigvalsh(shares).min()) >= -_TURNED_AWAY_SHARE

    def _quickest(self, gains: LoopGains, plants: ComplexArray) -> LoopGains:
        """Return the quickest loop from these gains on.

        From slow to quick: a loop that keeps its margin all the way from one that is stable for
        being slow is stable as well.
        """
        best, step, refinements = gains, _STEP, 0
        while best.bandwidth_rad_s < _FASTEST_rad_s and refinements < _REFINEMENTS:
            tried = self._with(best, best.bandwidth_rad_s * step)
            if self._keeps(tried, plants):
                best = tried
            else:
                step, refinements = math.sqrt(step), refinements + 1
        return best

    def _with(self, gains: LoopGains, bandwidth_rad_s: float) -> LoopGains:
        gains = replace(gains, bandwidth_rad_s=bandwidth_rad_s)
        rate = gains.integral_share * 2.0 * DAMPING_RATIO * self._slowest_rad_s(gains)
        return replace(gains, integral_1_s=min(_INTEGRAL_RATE_1_s, rate))

    def _slowest_rad_s(self, gains: LoopGains) -> float:
        return float(self._along_modes(gains)[2].min())

    def _integral_N_m_s(self, gains: LoopGains) -> float:
        stiffness = np.exp(np.log(self._along_modes(gains)[1]).mean())
        return gains.integral_1_s * float(stiffness)


@dataclass(frozen=True)
class DesignedLoop:
    """The loop of a robot, and what it keeps at each of `design_poses`."""

    gains: LoopGains
    margins: tuple[LoopMargins, ...]
    modes: tuple[Mode, ...]
    """The least damped mode of robot and loop at each of them."""

    @property
    def slowest_rad_s(self) -> float:
        """Of the platform's modes in closed loop, at all poses."""
        return min(there.slowest_rad_s for there in self.margins)


@dataclass(frozen=True)
class _Robot:
    """What a loop is designed from; that of one robot is designed once."""

    platform: Platform
    rotors_kg: tuple[float, ...]
    stiffness_N: tuple[float, ...]
    period_s: float
    model: PlatformModel = field(compare=False)


def designed_loop(model: PlatformModel, axes: Sequence[RobotAxis], period_s: float) -> DesignedLoop:
    """Return the loop of a robot with these axes, one for each of the n cables.

    Raises GeometryError where the cables do not hold the platform, UnstableError where no loop
    does.
    """
    winches = [axis.winch for axis in axes]
    rotors_kg = [w.motor.rotor_inertia_kg_m2 / w.cable_m_per_motor_rad**2 for w in winches]
    stiffness_N = [w.cable.stiffness_N for w in winches]
    return _designed(_Robot(model.platform, tuple(rotors_kg), tuple(stiffness_N), period_s, model))


@lru_cache(maxsize=4)
def _designed(robot: _Robot) -> DesignedLoop:
    rotors_kg, stiffness_N = np.array(robot.rotors_kg), np.array(robot.stiffness_N)
    loop = LoopModel(robot.model, rotors_kg, stiffness_N, robot.period_s)
    gains = loop.design()
    return DesignedLoop(gains, tuple(loop.margins(gains)), tuple(loop.least_damped(gains)))

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
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from cdpr_rt.arrays import FloatArray
from cdpr_rt.errors import GeometryError
from cdpr_rt.robots.platform.design.loop_cycle import (
    Mode,
    cycle_matrix,
    dies_down,
    least_damped,
)
from cdpr_rt.robots.platform.design.loop_gains import (
    DAMPING_RATIO,
    LoopGains,
    LoopMargins,
    OBSERVER_rad_s,
    latency_s,
)
from cdpr_rt.robots.platform.design.loop_plant import (
    BETWEEN,
    GREATEST,
    LEAST,
    NONE,
    CABLE_DAMPING_s,
    linear_plant,
)
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
_CALMING_STEP, _LEAST_SHARE = 0.93, 0.2
"""Of a loop's damping, by which and to what share it is weakened until its modes die down."""
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
        cable_damping_s: float = CABLE_DAMPING_s,
    ) -> None:
        """Take rotors' masses (n,) as the cables feel them, EA (n,), and set-points (m, d).

        Cables' damping over their stiffness counts where it is less than CABLE_DAMPING_s, which
        margins are computed with.

        Raises GeometryError where the cables do not hold the platform at one of them.
        """
        self.period_s, self.rotor_kg = period_s, float(rotors_kg.mean())
        self.cable_damping_s = cable_damping_s
        self._positions = model.positions
        self._lightest_kg = float(rotors_kg.min())
        self.poses = design_poses(model) if poses is None else poses
        highest = min(_HIGHEST_Hz, 0.3 / period_s)
        below = np.geomspace(_LOWEST_Hz, _LOW_Hz, _BELOW, endpoint=False)
        self.frequency_Hz = np.append(below, np.geomspace(_LOW_Hz, highest, _FREQUENCIES))
        self._s = s = (2j * np.pi * self.frequency_Hz).astype(np.complex128)
        self._late = np.exp(-s * latency_s(period_s)) / (1.0 + s / OBSERVER_rad_s) ** 2
        self._rotors_kg, self._hardest = rotors_kg, 0
        self._swings: LoopGains | None = None
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

    def least_damped(self, gains: LoopGains, cable_damping_s: float) -> tuple[Mode, ...]:
        """Return the least damped mode of a cycle of robot and loop at each of the poses.

        The cables' damping is this over their stiffness.
        """
        return tuple(self._least_damped(gains, i, cable_damping_s) for i in range(len(self.poses)))

    def _least_damped(self, gains: LoopGains, i: int, cable_damping_s: float) -> Mode:
        return least_damped(self._cycles(gains, i, cable_damping_s), self.period_s)

    def _cycles(self, gains: LoopGains, i: int, cable_damping_s: float) -> FloatArray:
        damping, stiffness, _ = self._along_modes(gains)
        plant = self._linear[i]
        law = gains, damping[i], stiffness[i], self.period_s, cable_damping_s
        cycles = [
            cycle_matrix(
                plant,
                share,
                plant.stiffness_N_m[level],
                plant.geometric_N_m[level],
                self._rotors_kg,
                *law,
            )
            for share in STIFFNESS_SHARES
            for level in (LEAST, BETWEEN, GREATEST)
        ]
        return np.array(cycles)

    def dies_down(self, gains: LoopGains, cable_damping_s: float) -> bool:
        """Return whether all modes do at all poses, the one first where one did not before."""
        for i in sorted(range(len(self.poses)), key=lambda i: i != self._hardest):
            if not dies_down(self._cycles(gains, i, cable_damping_s)):
                self._hardest, self._swings = i, gains
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

        Where the cables are known to damp less than was assumed, weaker ones whose modes die down
        all the same are looked for. Raises UnstableError where none holds the platform, SwingsError
        where modes would grow.
        """
        best, loops = self._soonest()
        if self.cable_damping_s >= CABLE_DAMPING_s:
            return best
        calm = self._calmed(loops, self.cable_damping_s)
        if calm is None or not self._keeps(calm, self._plants(calm), FOLLOWED_MARGIN):
            raise self._swinging(self.cable_damping_s)
        return calm

    def _soonest(self) -> tuple[LoopGains, list[LoopGains]]:
        """Return the loop for cables that damp as assumed, and those that it is the best of.

        They keep it at all poses, with all stiffness. Dry friction in the winches, about the same
        in each, is what keeps a platform from its target, and the integral part what overcomes it:
        in N/(m s) of cable, in the geometric mean over the modes.

        It is designed for elastic cables, and judged with tensions that follow the pose, from none
        on to the greatest that may be planned. Where that takes too much of its margin it is
        designed anew, for tensions of the set-point; and where none is stiff enough for those that
        turn the platform away, for some that follow. In a cycle of robot and loop all modes die
        down.
        """
        turning, late_s = self._geometric_N_m, latency_s(self.period_s) + 2.0 / OBSERVER_rad_s
        loops = self._loops(self._elastic, np.zeros_like(turning), follows_pose=True)
        keeps = bool(loops) and self._keeps(loops[0], self._followed, FOLLOWED_MARGIN)
        if keeps and self.dies_down(loops[0], CABLE_DAMPING_s):
            return loops[0], loops
        self._swings = None  # what that loop drives says nothing of those that are designed now
        # followed late, it takes of the damping what it would have taken of the stiffness
        for plants, turned, follows in (
            (self._planned, turning, False),
            (self._followed, late_s * turning, True),
        ):
            loops = self._loops(plants, turned, follows_pose=follows)
            if not loops or not self._keeps(loops[0], plants, FOLLOWED_MARGIN):
                continue
            best = self._calmed(loops, CABLE_DAMPING_s)
            if best is not None and self._keeps(best, plants, FOLLOWED_MARGIN):
                return best, loops
        if self._swings is None:
            raise UnstableError(
                "its tensions turn the platform away faster than a loop can hold it"
            )
        raise self._swinging(CABLE_DAMPING_s)

    def _swinging(self, cable_damping_s: float) -> SwingsError:
        q = [f"{x:.2f}" for x in self.poses[self._hardest]]
        place, turn = ", ".join(q[: self._positions]), ", ".join(q[self._positions :])
        assert self._swings is not None
        mode = self._least_damped(self._swings, self._hardest, cable_damping_s)
        return SwingsError(
            f"whatever its gains, the loop drives a mode at {mode.frequency_Hz:.3g} Hz to "
            f"swing where the platform is at ({place}) m"
            + (f", turned by ({turn}) rad" if turn else "")
        )

    def _loops(
        self, plants: ComplexArray, turning: FloatArray, *, follows_pose: bool
    ) -> list[LoopGains]:
        """Return the quickest loop of each kind that holds the platform, the soonest first."""
        found = []
        tried = itertools.product(_SMOOTHERS_Hz, _ROTOR_SHARES, _INTEGRAL_SHARES)
        for (smooth, smoother_Hz), share, integral in tried:
            slow = self._slow(smooth, 2.0 * math.pi * smoother_Hz, share, integral)
            gains = self._slowest(replace(slow, follows_pose=follows_pose), plants, turning)
            if gains is not None:
                found.append(self._quickest(gains, plants))
        return sorted(found, key=self._integral_N_m_s, reverse=True)

    def _calmed(self, loops: list[LoopGains], cable_damping_s: float) -> LoopGains | None:
        """Return the soonest of the loops, the soonest first, weakened until all modes die down.

        None where no loop's do.
        """
        best, soonest = None, 0.0
        for gains in loops:
            share, weak = 1.0, gains
            while share >= _LEAST_SHARE and self._integral_N_m_s(weak) > soonest:
                if self.dies_down(weak, cable_damping_s):
                    best, soonest = weak, self._integral_N_m_s(weak)
                    break
                share *= _CALMING_STEP
                weak = self._weakened(gains, share)
        return best

    def _weakened(self, gains: LoopGains, share: float) -> LoopGains:
        """Return the loop with this share of its damping."""
        weak = replace(
            gains,
            damping_N_s_m=share * gains.damping_N_s_m,
            null_damping_N_s_m=share * gains.null_damping_N_s_m,
        )
        return self._with(weak, share * gains.bandwidth_rad_s)

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

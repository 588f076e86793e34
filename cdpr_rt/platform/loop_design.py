"""Design of a platform's loop from its rotors, cables, delays and mass, and its margins.

The plant is that of `loop_plant`: x = -G τ, with the rotors' x as paid-out cable. From x the loop
computes the motors' pull τ = C(s) x, with a delay. The largest singular value of the sensitivity (1
+ C G)^-1 shows how far the eigenvalues of the return difference are from 0. Its inverse, the
modulus margin μ, is a gain margin of at least 1/(1 - μ) and a phase margin of at least 2 asin(μ/2)
(Skogestad and Postlethwaite, Multivariable Feedback Control, 2.4.3).

Tensions that are planned for the platform's pose follow it with a delay, and so remove the
geometric stiffness K_G that they cause. If L(s) is the low-pass of x, the plant becomes G' = (1 - G
L K_G)^-1 G. If the cables are not much stiffer than K_G, tensions are planned for the set-point
instead. K_G then acts on the platform whenever it leaves the set-point.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdpr_profiles import RobotAxis
from cdpr_profiles.platform import Platform
from cdpr_rt.arrays import FloatArray
from cdpr_rt.errors import GeometryError
from cdpr_rt.jit import jit
from cdpr_rt.model.platform_model import PlatformModel
from cdpr_rt.platform.loop_kernel import STRETCH_SHARE
from cdpr_rt.platform.loop_plant import (
    BETWEEN,
    DAMPING_RATIO,
    GREATEST,
    LEAST,
    NONE,
    CABLE_DAMPING_s,
    DRIVE_LATENCY_s,
    LinearPlant,
    LITTLE_DAMPING_s,
    LoopGains,
    LoopMargins,
    OBSERVER_rad_s,
    latency_s,
    linear_plant,
)

# Kernel of a loop's design: whether a loop keeps its margin at all frequencies.

ComplexArray = NDArray[np.complex128]


@jit
def keeps_margin(
    plants: ComplexArray,
    of_speed: ComplexArray,
    of_place: ComplexArray,
    damping: FloatArray,
    stiffness: FloatArray,
    least: float,
    scratch: ComplexArray,
) -> bool:
    """Return whether no singular value of any return difference S = 1 + C G is below `least`.

    `plants` (m, k, f, d, d) are G at m poses with k stiffnesses, and C is diagonal: `of_speed` (f,)
    times `damping` (m, d) and `of_place` (f,) times `stiffness` (m, d). No singular value is below
    `least` if S^H S - least² 1 has a Cholesky factor. A quicker sufficient test: each |s_aa|
    exceeds, by `least`, half the sum of the other magnitudes in its row and column (C. R. Johnson,
    A Gersgorin-type lower bound for the smallest singular value, 1989). `scratch` (2, d, d) is
    overwritten.
    """
    m, k, f, d, _ = plants.shape
    S, H = scratch[0], scratch[1]
    for j in range(m):
        for i in range(k):
            for w in range(f):
                for a in range(d):
                    C = of_speed[w] * damping[j, a] + of_place[w] * stiffness[j, a]
                    for b in range(d):
                        S[a, b] = C * plants[j, i, w, a, b]
                    S[a, a] += 1.0
                if not _is_dominated(S, least) and not _is_positive_definite(S, H, least * least):
                    return False
    return True


@jit
def _is_dominated(S: ComplexArray, least: float) -> bool:
    """Return whether the diagonal of `S` (d, d) bounds its singular values by `least` from below.

    Magnitudes off the diagonal are replaced by |re| + |im|, which needs no roots and is never
    smaller.
    """
    d = S.shape[0]
    for a in range(d):
        beside = 0.0
        for b in range(d):
            if b != a:
                row, column = S[a, b], S[b, a]
                beside += abs(row.real) + abs(row.imag) + abs(column.real) + abs(column.imag)
        bound = least + 0.5 * beside
        if not S[a, a].real ** 2 + S[a, a].imag ** 2 > bound * bound:
            return False
    return True


@jit
def _is_positive_definite(S: ComplexArray, H: ComplexArray, square: float) -> bool:
    """Return whether S^H S - square 1 is positive definite; write its factor into `H`."""
    d = S.shape[0]
    for b in range(d):
        for a in range(b, d):
            entry = 0j
            for k in range(d):
                entry += S[k, a] * S[k, b].conjugate()
            for k in range(b):
                entry -= H[a, k] * H[b, k].conjugate()
            if a == b:
                pivot = entry.real - square
                if not pivot > 0.0:
                    return False
                H[b, b] = np.sqrt(pivot)
            else:
                H[a, b] = entry / H[b, b].real
    return True


# Eigenvalues of one cycle of a robot and its platform's loop, linearised at a pose. They supplement
# the margins in the frequency domain. Rotors and platform on their cables, as in `loop_plant` along
# the modes, m_r x'' = T - τ, λ q'' = -P^T T - K_G q, T = k (P q - x) + b k (P q' - x'), are
# discretised exactly for torques that are constant over a cycle and act one cycle plus the drive's
# delay after the angles from which they are computed. The control of a cycle is that of its
# kernels: observer and low-pass of the velocity, pose by x and its stretch, D' and K', the integral
# part at its rate in motion, damping of cables against each other, and tensions that follow the
# pose if they do. Saturation, deadband, friction and bounds of tensions are not included. An
# eigenvalue z of the matrix of one cycle T oscillates with ln(z)/T = (-ζ ± i sqrt(1 - ζ²)) ω. It
# decays if |z| < 1.

_SQUARINGS, _GROWN = 18, 1e12
"""Number of squarings of a cycle's matrix, up to the power 2^18. If the norm of a power is above
the second number, modes grow."""
_TERMS, _MOST_NORM = 13, 0.5
"""Number of terms of the exponential series, and the largest norm of a matrix for which their sum
is exact to 1e-15."""


class Mode(NamedTuple):
    """Oscillation of one mode of a loop."""

    frequency_Hz: float
    damping_ratio: float
    """ζ, negative if the mode grows."""

    @property
    def dies_down_s(self) -> float:
        """Time after which the amplitude has fallen to 2 %."""
        rate = self.damping_ratio * math.tau * self.frequency_Hz
        return math.log(50.0) * math.sqrt(1.0 - self.damping_ratio**2) / rate


def least_damped(cycle: FloatArray, period_s: float) -> Mode:
    """Return the least damped mode of cycles (..., size, size) of a period."""
    z = np.linalg.eigvals(cycle).ravel()
    rate = np.log(np.maximum(np.abs(z), 1e-300)) + 1j * np.angle(z)
    ratio = -rate.real / np.maximum(np.abs(rate), 1e-300)
    i = int(ratio.argmin())
    return Mode(abs(float(rate[i].imag)) / (math.tau * period_s), float(ratio[i]))


def dies_down(cycle: FloatArray) -> bool:
    """Return whether all modes of cycles (..., size, size) decay.

    Repeated squaring shows it: |z| < 1 if the norm of a power is below 1. This takes a fifth of the
    time of the eigenvalues. A mode that needs more than 2^18 cycles counts as growing.
    """
    power = cycle
    for _ in range(_SQUARINGS):
        power = power @ power
        norms = np.abs(power).sum(axis=-1).max(axis=-1)
        if norms.max() < 1.0:
            return True
        if norms.max() > _GROWN:
            return False
    return False


def cycle_matrix(
    plant: LinearPlant,
    share: float,
    k: FloatArray,
    K_G: FloatArray,
    rotors_kg: FloatArray,
    gains: LoopGains,
    damping: FloatArray,
    stiffness: FloatArray,
    period_s: float,
    cable_damping_s: float,
) -> FloatArray:
    """Return the matrix of one cycle (size, size) with this share of the cables' stiffness k (n,).

    The stiffness k and K_G (d, d) belong to certain tensions. Rotor masses are (n,). D' and K' (d,)
    are the loop's `damping` and `stiffness` along the modes. The cables' own damping is a ratio to
    k.
    """
    P = plant.pulls
    n, d = P.shape
    late, rest, held = _motion(plant, share * k, K_G, rotors_kg, period_s, cable_damping_s)
    size, follows = 2 * (d + n), gains.follows_pose
    widths = [size, n, n, d, d, d, *[d, d] * follows, *[n] * (held + 1)]
    state, x, v, once, calm, integral, *rows = np.split(np.eye(sum(widths)), np.cumsum(widths)[:-1])
    followed, torques = rows[: 2 * follows], rows[2 * follows :]
    decay = math.exp(-OBSERVER_rad_s * period_s)
    lowpass = 1.0 - math.exp(-gains.smoother_rad_s * period_s)
    predicted = x + period_s * v
    error = state[d : d + n] - predicted
    x, v = predicted + (1.0 - decay**2) * error, v + (1.0 - decay) ** 2 / period_s * error
    speed = P.T @ v
    once = once + lowpass * (speed - once)
    calm = calm + lowpass * (once - calm)
    place = P.T @ x
    if follows:
        place += P.T @ ((P @ followed[1]) / k[:, None])
    proportional = stiffness[:, None] * place
    integral = integral + gains.integral_1_s * period_s * proportional
    damped = damping[:, None] * (speed + gains.smooth * (calm - speed))
    force = proportional + damped + integral
    if follows:
        planned = -K_G @ place
        force = force + planned
        # the pose of a cycle uses the stretch of the one before
        followed = [followed[0] + STRETCH_SHARE * (planned - followed[0]), followed[0]]
    torque = P @ force + gains.null_damping_N_s_m * (v - P @ speed)
    moved = late @ np.vstack([state, torques[-1]])
    moved = rest @ np.vstack([moved, torques[-2]])
    return np.vstack([moved, x, v, once, calm, integral, *followed, torque, *torques[:-1]])


def _motion(
    plant: LinearPlant,
    k: FloatArray,
    K_G: FloatArray,
    rotors_kg: FloatArray,
    period_s: float,
    cable_damping_s: float,
) -> tuple[FloatArray, FloatArray, int]:
    """Return the transition matrices of plant and torque in the two parts of a cycle (size, size +
    n).

    In the first part the torque of `held` cycles ago still acts, in the second the next one;
    `held` is also returned.
    """
    P = plant.pulls
    n, d = P.shape
    size, mass = 2 * (d + n), np.append(plant.mass_kg, rotors_kg)[:, None]
    stretch = np.hstack([P, -np.eye(n)])
    elastic = stretch.T * k @ stretch
    stiff = elastic.copy()
    stiff[:d, :d] += K_G
    F = np.zeros((size + n, size + n))
    # velocities in m per cycle, so that the exponential's series is short
    F[: d + n, d + n : size] = np.eye(d + n)
    F[d + n : size, : d + n] = -(period_s**2) * stiff / mass
    F[d + n : size, d + n : size] = -period_s * cable_damping_s * elastic / mass
    F[d + n + d : size, size:] = -np.diag(period_s**2 / rotors_kg)
    cycles, part = divmod(DRIVE_LATENCY_s / period_s, 1.0)
    return _exponential(F * part)[:size], _exponential(F * (1.0 - part))[:size], 1 + int(cycles)


def _exponential(F: FloatArray) -> FloatArray:
    """Return exp(F) (size, size): the series of exp(F/2^k), squared k times.

    SciPy's function takes seven times as long, which adds 2 s to each start of a robot with eight
    cables.
    """
    norm = float(np.abs(F).sum(axis=0).max())
    squarings = max(0, math.ceil(math.log2(max(norm, _MOST_NORM) / _MOST_NORM)))
    F = F / 2.0**squarings
    one = np.eye(len(F))
    found = one
    for i in range(_TERMS, 0, -1):
        found = one + F @ found / i
    for _ in range(squarings):
        found = found @ found
    return found


LEAST_MARGIN = 0.45
"""Modulus margin that the design keeps, with all stiffness in STIFFNESS_SHARES."""
FOLLOWED_MARGIN = 0.4
"""Margin of a loop designed without tensions, when it is checked with tensions that follow the
pose."""
STIFFNESS_SHARES = (0.7, 1.0, 1.3)
_SMOOTHERS_Hz = ((0.0, 25.0), (0.55, 25.0), (0.55, 12.0), (0.8, 12.0), (0.8, 8.0), (0.9, 12.0))
"""Shares of smooth velocity that are tried, each with the frequency of its low-pass."""
_ROTOR_SHARES = (1.6, 0.8, 0.4)
_LOOSE_SHARE = 0.075
_INTEGRAL_RATE_1_s = 5.0
_INTEGRAL_SHARES = (0.3, 0.15)
"""Rates of the integral part that are tried, as shares of 2 ζ ω of the slowest mode."""
_SLOWEST_rad_s, _FASTEST_rad_s = 1.0, 80.0
_TURNED_AWAY_SHARE = 0.5
"""Largest share of the loop's stiffness that tensions may remove, in the slowest loop tried."""
_STEP, _REFINEMENTS = 1.3, 3
_CALMING_STEP, _LEAST_SHARE = 0.93, 0.2
"""Factor by which a loop's damping is repeatedly reduced until its modes decay, and the smallest
share of the damping that is tried."""
_LOW_Hz, _HIGHEST_Hz, _FREQUENCIES = 0.3, 150.0, 64
_LOWEST_Hz, _BELOW = 0.02, 12
"""Lowest frequency of the slowest modes: tensions that follow a softer platform may make it drift
away."""


class UnstableError(GeometryError):
    """No loop can hold the robot's platform."""


class SwingsError(UnstableError):
    """Every loop makes a mode of the robot oscillate."""


def design_poses(model: PlatformModel) -> FloatArray:
    """Return the set-points (m, d) at which a loop is designed and checked.

    They are home, the middle and the corners of the box of targets, and the middle turned about
    each axis in both directions.
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
    """The linear model of a robot around some poses, for design and check of loops."""

    def __init__(
        self,
        model: PlatformModel,
        rotors_kg: FloatArray,
        stiffness_N: FloatArray,
        period_s: float,
        poses: FloatArray | None = None,
        cable_damping_s: float = CABLE_DAMPING_s,
    ) -> None:
        """Take rotors' masses (n,) at the cables, EA (n,), and set-points (m, d).

        The given ratio of cable damping to stiffness is used if it is less than CABLE_DAMPING_s;
        margins are computed with CABLE_DAMPING_s.

        Raises GeometryError if the cables cannot hold the platform at one of the set-points.
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

        `cable_damping_s` is the cables' damping over their stiffness.
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
        """Return whether all modes decay at all poses; starts with the last pose that failed."""
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
        """Return the factors of damping and stiffness in C(s), with latency, (frequencies,)."""
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
        """Return the loop that overcomes friction soonest among those that keep LEAST_MARGIN.

        If the cables are known to damp less than assumed, weaker loops whose modes still decay are
        searched. Raises UnstableError if no loop holds the platform, and SwingsError if modes would
        grow.
        """
        best, loops = self._soonest()
        if self.cable_damping_s >= CABLE_DAMPING_s:
            return best
        calm = self._calmed(loops, self.cable_damping_s)
        if calm is None or not self._keeps(calm, self._plants(calm), FOLLOWED_MARGIN):
            raise self._swinging(self.cable_damping_s)
        return calm

    def _soonest(self) -> tuple[LoopGains, list[LoopGains]]:
        """Return the best loop for cables that damp as assumed, and all candidates.

        The candidates keep the margin at all poses, with all stiffness. Dry friction in the
        winches, about equal in each, keeps a platform from its target, and the integral part
        overcomes it. So candidates are ranked by the gain of the integral part, in N/(m s) of
        cable, as geometric mean over the modes.

        The loop is designed for elastic cables, and checked with tensions that follow the pose,
        from zero to the greatest that may be planned. If the margin then is too small, the loop is
        designed again, for tensions of the set-point. If no loop is stiff enough for tensions that
        turn the platform away, it is designed for tensions that follow the pose. All modes must
        decay.
        """
        turning, late_s = self._geometric_N_m, latency_s(self.period_s) + 2.0 / OBSERVER_rad_s
        loops = self._loops(self._elastic, np.zeros_like(turning), follows_pose=True)
        keeps = bool(loops) and self._keeps(loops[0], self._followed, FOLLOWED_MARGIN)
        if keeps and self.dies_down(loops[0], CABLE_DAMPING_s):
            return loops[0], loops
        self._swings = None  # the modes of that loop do not apply to the next loops
        # tensions that follow with a delay reduce the damping, by the delay times their stiffness
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
                "its tensions turn the platform away faster than a control loop can react"
            )
        raise self._swinging(CABLE_DAMPING_s)

    def _swinging(self, cable_damping_s: float) -> SwingsError:
        q = [f"{x:.2f}" for x in self.poses[self._hardest]]
        place, turn = ", ".join(q[: self._positions]), ", ".join(q[self._positions :])
        assert self._swings is not None
        mode = self._least_damped(self._swings, self._hardest, cable_damping_s)
        return SwingsError(
            f"with any gains, a mode of the loop at {mode.frequency_Hz:.3g} Hz is unstable "
            f"with the platform at ({place}) m" + (f", turned by ({turn}) rad" if turn else "")
        )

    def _loops(
        self, plants: ComplexArray, turning: FloatArray, *, follows_pose: bool
    ) -> list[LoopGains]:
        """Return the quickest loop of each kind that holds the platform, ranked as in
        `_soonest`.
        """
        found = []
        tried = itertools.product(_SMOOTHERS_Hz, _ROTOR_SHARES, _INTEGRAL_SHARES)
        for (smooth, smoother_Hz), share, integral in tried:
            slow = self._slow(smooth, 2.0 * math.pi * smoother_Hz, share, integral)
            gains = self._slowest(replace(slow, follows_pose=follows_pose), plants, turning)
            if gains is not None:
                found.append(self._quickest(gains, plants))
        return sorted(found, key=self._integral_N_m_s, reverse=True)

    def _calmed(self, loops: list[LoopGains], cable_damping_s: float) -> LoopGains | None:
        """Return the first of the sorted loops whose modes all decay, weakened if necessary.

        Returns None if there is no such loop.
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
        """Return the slowest loop with these shares of smooth velocity and of a rotor's damping."""
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

        Tensions, such as those of crossed cables, may turn the platform away with the negative
        stiffness `turning` (..., d, d), N/m (a damping in N s/m if they follow its pose). The loop
        must then be stronger than `turning` and keep LEAST_MARGIN. Returns None if there is no such
        loop.
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

        The search goes from slow to quick loops. The slow loop is stable, and all loops that keep
        the margin continuously from there are also stable.
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


# The loop of a robot file, designed once, and its margins.


@dataclass(frozen=True)
class _Robot:
    """Input of a loop's design; equal inputs are designed only once."""

    platform: Platform
    bounds_N: tuple[tuple[float, ...], ...]
    """Smallest and greatest tensions and the reserve to both, which determine the geometric
    stiffness."""
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
    """The loop of a robot, and its properties at each of `design_poses`."""

    gains: LoopGains
    _robot: _Robot = field(repr=False)

    @property
    def margins(self) -> list[LoopMargins]:
        """Margins of the loop at these poses."""
        return self._judged.margins

    @property
    def modes(self) -> tuple[Mode, ...]:
        """The least damped mode of robot and loop at these poses."""
        return self._judged.modes

    @property
    def growing_modes(self) -> tuple[Mode, ...]:
        """The modes if the cables have only the damping LITTLE_DAMPING_s.

        Empty if no mode grows with this damping, or if the robot's cables have no more.
        """
        return self._judged.growing

    @property
    def slowest_rad_s(self) -> float:
        """Slowest of the platform's modes in closed loop, at all poses."""
        return min(there.slowest_rad_s for there in self.margins)

    @cached_property
    def _judged(self) -> _Judged:
        """Properties for reports only. The `LoopModel` is freed again, because it takes
        megabytes.
        """
        loop, gains, damping_s = _loop_model(self._robot), self.gains, self._robot.cable_damping_s
        calm = damping_s <= LITTLE_DAMPING_s or loop.dies_down(gains, LITTLE_DAMPING_s)
        growing = () if calm else loop.least_damped(gains, LITTLE_DAMPING_s)
        return _Judged(loop.margins(gains), loop.least_damped(gains, damping_s), growing)


def designed_loop(model: PlatformModel, axes: Sequence[RobotAxis], period_s: float) -> DesignedLoop:
    """Return the loop of a robot with these axes, one for each of the n cables.

    Raises GeometryError if the cables cannot hold the platform, and UnstableError if no loop can.
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

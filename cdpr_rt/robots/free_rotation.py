"""Oscillation of a platform in a plane about the rotation that no cable controls.

See `free_rotation_kernel`: with ψ(p, t) the angle at which tensions t at a position p have no
moment, a platform whose cables follow its position is turned from there by δ,

    I_s δ'' = -κ δ - I ψ''

all but undamped. ψ moves with position and tensions, and so with the acceleration: what a way
leaves is a swing of the amplitude sqrt(δ² + δ'²/ω²), ω² = κ/I_s. Friction of the winches, and the
loop's forces against it, set the platform swinging besides.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np

from cdpr_profiles.platform import Platform
from cdpr_rt.arrays import FloatArray
from cdpr_rt.robots.kinematics import free_rotation_kernel as kernel
from cdpr_rt.robots.platform_model import PlatformModel
from cdpr_rt.robots.rigid_body import inertia_kg_m2

SHAPING_s = 0.06
"""Over which the control averages its set-points, so that their acceleration does not step."""
_STEP_S = 2e-3
_SOLVED_EVERY = 10
"""Steps from one solution for ψ and κ to the next."""


@dataclass(frozen=True)
class FreeRotation:
    """The swing about a rotation that no cable controls, over the box of targets."""

    slowest_Hz: float
    fastest_Hz: float
    swing_rad: float
    """The amplitude that a way from corner to corner at full speed leaves, at most."""
    swing_m: float
    """Amplitude of an anchor point."""

    def lasts_s(self, amplitude_m: float) -> float:
        """Return for how long anchor points swing by more than an amplitude after such a way."""
        if self.swing_m <= amplitude_m:
            return 0.0
        rate_1_s = kernel.DAMPING_RATIO * math.tau * self.slowest_Hz
        return math.log(self.swing_m / amplitude_m) / rate_1_s


def rotation_of(platform: Platform) -> FloatArray:
    """Return the constant entries of a platform's `rotation`, (ROWS,); the rest is 0."""
    rotation = np.zeros(kernel.ROWS)
    rotation[kernel.MASS] = platform.mass_kg
    rotation[kernel.INERTIA] = inertia_kg_m2(platform)[2, 2]
    rotation[[kernel.CENTRE_x, kernel.CENTRE_y]] = platform.centre_of_mass_m[:2]
    return rotation


def free_rotation(model: PlatformModel) -> FreeRotation | None:
    """Return how a platform swings whose set-points are averaged over SHAPING_s.

    None where its cables control its angle, it has none, or they turn it over.
    """
    platform = model.platform
    if not model.kinematics.turns_freely:
        return None
    box = zip(platform.workspace_min_m, platform.workspace_max_m, strict=True)
    ways = np.array(list(itertools.permutations(itertools.product(*box), 2)))
    position_m, acceleration_m_s2 = _along(ways, platform.speed_m_s, platform.acceleration_m_s2)
    solved = position_m[::_SOLVED_EVERY], acceleration_m_s2[::_SOLVED_EVERY]
    psi, kappa, inertia, reach = np.moveaxis(_standing(model, *solved), -1, 0)
    if not (kappa > 0.0).all():
        return None
    omega = np.sqrt(kappa / inertia)
    share = rotation_of(platform)[kernel.INERTIA] / inertia
    steps = len(position_m)
    swing_rad = _swing_rad(*(_between(values, steps) for values in (psi, omega, share)))
    swing_m = float((swing_rad * reach[-1]).max())
    slowest, fastest = (float(x) / math.tau for x in (omega.min(), omega.max()))
    return FreeRotation(slowest, fastest, float(swing_rad.max()), swing_m)


def _along(ways: FloatArray, speed: float, most: float) -> tuple[FloatArray, FloatArray]:
    """Return positions and accelerations (steps, m, 2) along straight ways (m, 2, 2) from rest.

    Trapezoids of the speed, the longer direction at the bounds, averaged over SHAPING_s.
    """
    way = ways[:, 1] - ways[:, 0]
    far = np.abs(way).max(axis=1)
    top = np.minimum(speed, np.sqrt(most * far))
    speeding_s, whole_s = top / most, far / top + top / most
    averaged = max(1, round(SHAPING_s / _STEP_S))
    steps = math.ceil(float(whole_s.max()) / _STEP_S) + averaged + 1
    t = _STEP_S * np.arange(steps)[:, None]
    velocity = np.minimum(np.minimum(most * t, top), np.maximum(most * (whole_s - t), 0.0))
    speeding = np.where(t < speeding_s, most, 0.0)
    slope = speeding - np.where((t >= whole_s - speeding_s) & (t < whole_s), most, 0.0)
    place = np.minimum(np.cumsum(velocity, axis=0) * _STEP_S, far)
    share = way / far[:, None]
    place, slope = (_averaged(values, averaged)[..., None] * share for values in (place, slope))
    return ways[:, 0] + place, slope


def _averaged(values: FloatArray, count: int) -> FloatArray:
    """Return the mean (steps, m) over the last `count` steps, before which all is 0."""
    total = np.cumsum(values, axis=0)
    total[count:] -= total[:-count].copy()
    return total / count


def _standing(
    model: PlatformModel, position_m: FloatArray, acceleration_m_s2: FloatArray
) -> FloatArray:
    """Return ψ, κ, I_s and the farthest anchor point (steps, m, 4) under the planned tensions.

    κ is 0 where the platform turns over.
    """
    low, high = model.low_N + model.reserve_N, model.high_N - model.reserve_N
    planned, still = model.least_tensions(low, high), model.workspace(0.0)
    flat = position_m.reshape(-1, 2)
    wrenches = still.wrenches[0] - model.platform.mass_kg * acceleration_m_s2.reshape(-1, 2)
    t, rotation = np.zeros(model.kinematics.n), rotation_of(model.platform)
    found = np.zeros((len(flat), 4))
    poses = model.poses(flat)
    wrenches = wrenches + still.hanging_wrenches(poses)
    for k, W in enumerate(still.wrench_matrices(poses)):
        planned.solve(W, wrenches[k], t)
        found[k, 0] = kernel.turn_to_rest(model.kinematics.geometry, t, poses[k], rotation)
        if rotation[kernel.STEEPNESS] > 0.0:
            found[k, 1:] = rotation[[kernel.STIFFNESS, kernel.SWINGING, kernel.REACH]]
    return found.reshape(*position_m.shape[:-1], 4)


def _between(values: FloatArray, steps: int) -> FloatArray:
    """Return values (solved, m) at each step, (steps, m), linear from one solution to the next."""
    place = np.arange(steps) / _SOLVED_EVERY
    solved = np.arange(len(values))
    return np.stack([np.interp(place, solved, column) for column in values.T], axis=-1)


def _swing_rad(psi: FloatArray, omega: FloatArray, share: FloatArray) -> FloatArray:
    """Return the amplitudes (m,) that motions ψ (steps, m) leave, without damping.

    `share` (steps, m) is I/I_s.
    """
    moved = np.diff(psi, axis=0, prepend=psi[:1])
    swung, rate = np.zeros((2, psi.shape[1]))
    for k in range(len(psi)):
        rate -= _STEP_S * omega[k] ** 2 * swung
        swung += _STEP_S * rate - share[k] * moved[k]
    return np.asarray(np.hypot(swung, rate / omega[-1]))

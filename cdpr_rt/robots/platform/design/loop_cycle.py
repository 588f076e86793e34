"""One cycle of a robot and its platform's loop, linear around a pose: its eigenvalues.

Beside the margins of `loop_design`, which are taken in frequency, and know nothing of them: rotors
and platform on their cables, as `loop_plant` has them along the modes,

    m_r x'' = T - τ      λ q'' = -P^T T - K_G q      T = k (P q - x) + b k (P q' - x')

are discretised exactly for torques that are held for a cycle and act a cycle and the drive's delay
behind the angles that they come from. What the control does with those in a cycle is that of its
kernels: observer and low-pass of the velocity, pose by x and its stretch, D' and K', the integral
part at its rate in motion, damping of cables against each other, and tensions that follow the pose
where they do. Saturation, deadband, friction and bounds of tensions are not in it.

An eigenvalue z of the matrix of one cycle of T swings with ln(z)/T = (-ζ ± i sqrt(1 - ζ²)) ω: it
dies down where |z| < 1.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.robots.platform.design.loop_gains import DRIVE_LATENCY_s, LoopGains, OBSERVER_rad_s
from cdpr_rt.robots.platform.design.loop_plant import LinearPlant
from cdpr_rt.robots.platform.loop_kernel import STRETCH_SHARE

_SQUARINGS, _GROWN = 18, 1e12
"""Of a cycle, to a power of 2^18; and norm of a power that does not vanish any more."""
_TERMS, _MOST_NORM = 13, 0.5
"""Of the exponential's series, and of what it is summed for: exact to 1e-15."""


class Mode(NamedTuple):
    """How one mode of a loop swings."""

    frequency_Hz: float
    damping_ratio: float
    """ζ, negative where it grows."""

    @property
    def dies_down_s(self) -> float:
        """After which 2 % are left of it."""
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
    """Return whether all modes of cycles (..., size, size) do: |z| < 1 where a power's norm is < 1.

    By squaring, a fifth of the time that eigenvalues take. A mode that takes more than 2^18 cycles
    is counted as one that does not.
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

    That and K_G (d, d) are those of some tensions, rotors' masses (n,); D' and K' (d,) are the
    loop's `damping` and `stiffness` along the modes; cables' own damping is this over k.
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
        # the pose of a cycle is found by the stretch of the one before
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
    """Return what a cycle's two parts make of the plant and a torque (size, size + n).

    In the first the torque of `held` cycles ago acts yet, in the second the one after; `held` is
    returned as well.
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

    SciPy's takes seven times as long, 2 s more for each start of a robot on eight cables.
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

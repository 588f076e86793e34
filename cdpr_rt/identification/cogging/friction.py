"""The friction curve's shape: Stribeck speed and height, and its relaxation length.

Friction follows its steady curve g(v) = 1 + rise·exp(-(v/speed)²), relative to Coulomb friction,
only after a short sliding distance, as in the LuGre model (Canudas de Wit et al., 1995): over a
distance dx it moves towards sign(dx)·g by the share 1 - exp(-|dx|/(length·g)). This covers
stick-slip as well as sliding.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

from cdpr_rt.arrays import FloatArray
from cdpr_rt.identification.cogging.windows import IntArray, Windows, average, average_by_sign
from cdpr_rt.jit import jit

_LOWEST = (0.003, 0.02, 2e-4)
_HIGHEST = (1.5, 2.0, 2e-2)
_INSIDE = 1e-3
_STEPS = 15
_FIRST_STEP = 0.3
_DIFFERENCE = 3e-3
_CLOSE = 1e-4
_SPREAD_OF_MEDIAN = 1.4826
_LEAST_SPREAD_Nm = 2e-4
_TAIL = 2.5


@dataclass(frozen=True)
class FrictionShape:
    """Shape of the curve: relative rise at standstill, Stribeck speed, relaxation length."""

    rise: float = 0.25
    speed_rad_s: float = 0.2
    way_rad: float = 4e-3


STARTS = (FrictionShape(0.3, 0.1, 3e-3), FrictionShape(0.3, 0.4, 3e-3))


@jit
def _slide(angle: FloatArray, play: float, out: FloatArray) -> None:
    place = angle[0]
    out[0] = 0.0
    for i in range(1, angle.size):
        before = place
        place = min(max(place, angle[i] - play), angle[i] + play)
        out[i] = place - before


@jit
def _develop(state: float, slid: FloatArray, height: FloatArray, out: FloatArray) -> None:
    """Relax the friction step by step; `out` (k,) holds the decay factors, then the friction."""
    for i in range(out.size):
        goal = height[i] if slid[i] > 0.0 else -height[i]
        out[i] = state = goal + (state - goal) * out[i]


def sliding(angle: FloatArray, play: float) -> FloatArray:
    """Return the sliding distance before each sample of a motion, signed; arrays (k,).

    Movements within `play` to either side count as noise of the encoder, which would otherwise
    relax the friction.
    """
    out = np.empty_like(angle)
    _slide(angle, play, out)
    return out


def relative_friction(slid: FloatArray, velocity: FloatArray, shape: FrictionShape) -> FloatArray:
    """Return friction over Coulomb friction along a motion, signed; all arrays (k,)."""
    height = 1.0 + shape.rise * np.exp(-((velocity / shape.speed_rad_s) ** 2))
    out: FloatArray = np.exp(-np.abs(slid) / (shape.way_rad * height))
    _develop(1.0 if velocity[0] > 0.0 else -1.0, slid, height, out)
    return out


@dataclass(frozen=True)
class FrictionRun:
    """One run for the search of the shape: windows, torque without cogging and inertia."""

    windows: Windows
    torque_Nm: FloatArray
    rows: IntArray

    @cached_property
    def speed_rad_s(self) -> FloatArray:
        """Mean velocity in each of the rows."""
        w = self.windows
        means = average(w.velocity_rad_s[:, np.newaxis], w, 0, w.torque_Nm.size)
        return np.asarray(means[self.rows, 0])

    @cached_property
    def slid_rad(self) -> FloatArray:
        """Sliding distance before each sample; see `sliding`."""
        return sliding(self.windows.angle_rad, self.windows.play_rad)

    def regressors(self, shape: FrictionShape) -> FloatArray:
        """Return forward friction, backward friction and velocity of the rows, (rows, 3)."""
        w = self.windows
        friction = relative_friction(self.slid_rad, w.velocity_rad_s, shape)
        out = np.zeros((self.rows.size, 3))
        average_by_sign(friction, w, self.rows, out)
        out[:, 2] = self.speed_rad_s
        return out


def fit_shape(
    motions: Sequence[FrictionRun], starts: Sequence[FrictionShape] = STARTS
) -> FrictionShape:
    """Return the shape whose friction, with viscosity, leaves the smallest error.

    Separable least squares: the linear coefficients are solved for in every step. Each run has its
    own noise level and Huber weights, so that a run with hunting does not dominate. The search
    begins at each of `starts`.
    """
    # logarithms from one below the lowest on, so that the differences' steps are never of zero
    origin = np.log(_LOWEST) - 1.0
    low, high = np.ones(3), np.log(_HIGHEST) - origin
    equal = [np.ones(m.rows.size) for m in motions]
    weights = [
        _weights(_residuals([m], [w], starts[0])[0]) for m, w in zip(motions, equal, strict=True)
    ]

    def weighted(point: FloatArray) -> FloatArray:
        residuals = _residuals(motions, weights, _shape(point + origin))
        return np.concatenate([np.sqrt(w) * r for w, r in zip(weights, residuals, strict=True)])

    points = [np.log((s.rise, s.speed_rad_s, s.way_rad)) - origin for s in starts]
    for _ in range(2):
        found = [
            scipy.optimize.least_squares(
                weighted,
                np.clip(point, low + _INSIDE, high - _INSIDE),
                bounds=(low, high),
                x_scale=_FIRST_STEP,
                diff_step=[_DIFFERENCE] * 3,
                ftol=_CLOSE,
                xtol=_CLOSE,
                gtol=None,
                max_nfev=_STEPS,
            )
            for point in points
        ]
        points = [min(found, key=lambda f: float(f.cost)).x]
        shape = _shape(points[0] + origin)
        weights = [_weights(r) for r in _residuals(motions, weights, shape)]
    return shape


def _shape(logarithms: FloatArray) -> FrictionShape:
    return FrictionShape(*(float(v) for v in np.exp(logarithms)))


def _weights(residual: FloatArray) -> FloatArray:
    """Return Huber's weights over the square of the residuals' own spread."""
    size = np.abs(residual)
    spread = max(_SPREAD_OF_MEDIAN * float(np.median(size)), _LEAST_SPREAD_Nm)
    return np.asarray(np.minimum(1.0, _TAIL * spread / np.maximum(size, 1e-12)) / spread**2)


def _residuals(
    motions: Sequence[FrictionRun], weights: Sequence[FloatArray], shape: FrictionShape
) -> list[FloatArray]:
    """Return each run's errors after solving for the linear coefficients."""
    xs = [motion.regressors(shape) for motion in motions]
    parts = list(zip(xs, motions, weights, strict=True))
    gram = np.sum([(x.T * w) @ x for x, _, w in parts], axis=0)
    right = np.sum([(x.T * w) @ m.torque_Nm for x, m, w in parts], axis=0)
    size = np.sqrt(np.maximum(np.diag(gram), 1e-30))
    beta = np.linalg.solve(gram / np.outer(size, size) + 1e-9 * np.eye(3), right / size) / size
    return [m.torque_Nm - x @ beta for x, m, _ in parts]

"""The friction curve's shape: Stribeck speed and height, and the way it takes to develop.

Friction follows its steady curve g(v) = 1 + rise·exp(-(v/speed)²), relative to Coulomb friction,
only after a short way of sliding, as in the LuGre model (Canudas de Wit et al., 1995): over a way
dx it moves towards sign(dx)·g by the share 1 - exp(-|dx|/(way·g)). A rotor that sticks and slips
is thus described as well as one that slides.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cdpr_rt.exchange import FloatArray
from cdpr_rt.identification.simplex import minimise
from cdpr_rt.identification.windows import IntArray, Windows, average
from cdpr_rt.jit import jit

_LOWEST = (0.003, 0.02, 2e-4)
_HIGHEST = (1.5, 2.0, 2e-2)
_STEPS = 50
_FIRST_STEP = 0.3
_SPREAD_OF_MEDIAN = 1.4826
_LEAST_SPREAD_Nm = 2e-4
_TAIL = 2.5


@dataclass(frozen=True)
class FrictionShape:
    """Shape of the curve: relative rise at standstill, Stribeck speed, relaxation way."""

    rise: float = 0.25
    speed_rad_s: float = 0.2
    way_rad: float = 4e-3


STARTS = (FrictionShape(0.3, 0.1, 3e-3), FrictionShape(0.3, 0.4, 3e-3))


@jit
def _follow(
    angle: FloatArray,
    velocity: FloatArray,
    play: float,
    rise: float,
    speed: float,
    way: float,
    out: FloatArray,
) -> None:
    state = 1.0 if velocity[0] > 0.0 else -1.0
    out[0] = state
    place = angle[0]
    for i in range(1, angle.size):
        before = place
        place = min(max(place, angle[i] - play), angle[i] + play)
        step = place - before
        ratio = velocity[i] / speed
        height = 1.0 + rise * math.exp(-ratio * ratio)
        goal = height if step > 0.0 else -height
        state = goal + (state - goal) * math.exp(-abs(step) / (way * height))
        out[i] = state


def relative_friction(
    angle: FloatArray, velocity: FloatArray, play: float, shape: FrictionShape
) -> FloatArray:
    """Return friction over Coulomb friction along a motion, signed; all arrays (k,).

    Movements within `play` to either side count as noise of the reading: to and fro, they would
    seem to wear the friction down.
    """
    out = np.zeros_like(angle)
    _follow(angle, velocity, play, shape.rise, shape.speed_rad_s, shape.way_rad, out)
    return out


@dataclass(frozen=True)
class Motion:
    """What the search for the shape sees of one run: windows, cogging and inertia taken off."""

    windows: Windows
    torque_Nm: FloatArray
    rows: IntArray


def fit_shape(motions: Sequence[Motion], starts: Sequence[FrictionShape] = STARTS) -> FrictionShape:
    """Return the shape whose friction, with viscosity, leaves the smallest error.

    For every shape tried the linear coefficients are solved for. Each run has its own level of
    error, and rows far outside it count little: a run in which the rotor hunts must not decide.
    The search begins at each of `starts`.
    """
    low, high = np.log(_LOWEST), np.log(_HIGHEST)
    equal = [np.ones(m.rows.size) for m in motions]
    weights = [
        _weights(_residuals([m], [w], starts[0])[0]) for m, w in zip(motions, equal, strict=True)
    ]

    def objective(point: FloatArray) -> float:
        inside = np.clip(point, low, high)
        residuals = _residuals(motions, weights, FrictionShape(*np.exp(inside)))
        total = sum(float(w @ r**2) for w, r in zip(weights, residuals, strict=True))
        return math.log(total + 1e-30) + float(np.sum((point - inside) ** 2))

    points = [np.log((s.rise, s.speed_rad_s, s.way_rad)) for s in starts]
    for _ in range(2):
        found = [minimise(objective, p, _FIRST_STEP, _STEPS) for p in points]
        points = [min(found, key=lambda f: f[1])[0]]
        shape = FrictionShape(*(float(v) for v in np.exp(np.clip(points[0], low, high))))
        weights = [_weights(r) for r in _residuals(motions, weights, shape)]
    return shape


def _weights(residual: FloatArray) -> FloatArray:
    """Return Huber's weights over the square of the residuals' own spread."""
    size = np.abs(residual)
    spread = max(_SPREAD_OF_MEDIAN * float(np.median(size)), _LEAST_SPREAD_Nm)
    return np.asarray(np.minimum(1.0, _TAIL * spread / np.maximum(size, 1e-12)) / spread**2)


def _residuals(
    motions: Sequence[Motion], weights: Sequence[FloatArray], shape: FrictionShape
) -> list[FloatArray]:
    """Return each run's errors after solving for the linear coefficients."""
    xs = []
    for motion in motions:
        w = motion.windows
        friction = relative_friction(w.angle_rad, w.velocity_rad_s, w.play_rad, shape)
        values = (np.maximum(friction, 0.0), np.minimum(friction, 0.0), w.velocity_rad_s)
        xs.append(average(np.column_stack(values), w, 0, w.torque_Nm.size)[motion.rows])
    parts = list(zip(xs, motions, weights, strict=True))
    gram = np.sum([(x.T * w) @ x for x, _, w in parts], axis=0)
    right = np.sum([(x.T * w) @ m.torque_Nm for x, m, w in parts], axis=0)
    size = np.sqrt(np.maximum(np.diag(gram), 1e-30))
    beta = np.linalg.solve(gram / np.outer(size, size) + 1e-9 * np.eye(3), right / size) / size
    return [m.torque_Nm - x @ beta for x, m, _ in parts]

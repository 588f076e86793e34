"""The friction curve's shape: Stribeck speed and height, and the way it takes to develop.

Friction follows its steady curve g(v) = 1 + rise·exp(-(v/speed)²), relative to Coulomb friction,
only after a short way of sliding, as in the LuGre model (Canudas de Wit et al., 1995): over a way dx
it moves towards sign(dx)·g by the share 1 - exp(-|dx|/(way·g)). A rotor that sticks and slips is
thus described as well as one that slides.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from cdpr_rt.exchange import FloatArray
from cdpr_rt.identification.windows import IntArray, Windows, average
from cdpr_rt.jit import jit

_LOWEST = (0.003, 0.02, 2e-4)
_HIGHEST = (1.5, 2.0, 2e-2)
_STARTS = ((0.3, 0.1, 3e-3), (0.3, 0.4, 3e-3))
_STEPS = 60
_DEPENDENT = 8.0
"""Windows that overlap and noise that lasts: so many rows count as one."""
_TRUST = 0.3


@dataclass(frozen=True)
class FrictionShape:
    """Shape of the curve: relative rise at standstill, Stribeck speed, relaxation way."""

    rise: float = 0.25
    speed_rad_s: float = 0.2
    way_rad: float = 4e-3


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
    """What the search for the shape sees of one run: windows, with the cogging taken off."""

    windows: Windows
    torque_Nm: FloatArray
    rows: IntArray


def fit_shape(motions: Sequence[Motion], start: FrictionShape | None = None) -> FrictionShape:
    """Return the shape whose friction, with inertia and viscosity, leaves the smallest error.

    For every shape tried the linear coefficients are solved for. The error's level is taken for
    each run by itself. With `start` the search begins there and leaves it only for good reason.
    """
    rows = sum(m.rows.size for m in motions)
    low, high = np.log(_LOWEST), np.log(_HIGHEST)
    level = np.ones(len(motions))

    def errors(point: FloatArray) -> FloatArray:
        return _errors(motions, level, FrictionShape(*np.exp(np.clip(point, low, high))))

    def objective(point: FloatArray) -> float:
        inside = np.clip(point, low, high)
        cost = 0.5 * rows / _DEPENDENT * math.log(float(np.sum(errors(point) / level**2)) + 1e-30)
        if start is not None:
            cost += 0.5 * float(np.sum(((inside - centre) / _TRUST) ** 2))
        return cost + 1e3 * float(np.sum((point - inside) ** 2))

    centre = np.log([start.rise, start.speed_rad_s, start.way_rad]) if start else np.zeros(3)
    points = [centre] if start else [np.log(s) for s in _STARTS]
    for _ in range(2):
        found = [
            minimize(objective, p, method="Nelder-Mead", options={"maxfev": _STEPS, "xatol": 0.02})
            for p in points
        ]
        best = min(found, key=lambda f: float(f.fun))
        points = [best.x]
        counts = np.array([m.rows.size for m in motions])
        level = np.maximum(np.sqrt(errors(best.x) / counts), 2e-4)
    return FrictionShape(*(float(v) for v in np.exp(np.clip(best.x, low, high))))


def _errors(motions: Sequence[Motion], level: FloatArray, shape: FrictionShape) -> FloatArray:
    """Return each run's sum of squared errors after solving for the linear coefficients."""
    xs, ys = [], []
    for motion in motions:
        w = motion.windows
        friction = relative_friction(w.angle_rad, w.velocity_rad_s, w.play_rad, shape)
        values = (np.maximum(friction, 0.0), np.minimum(friction, 0.0), w.velocity_rad_s)
        columns = average(np.column_stack(values), w, 0, w.torque_Nm.size)
        x = np.column_stack([columns, w.acceleration_rad_s2])[motion.rows]
        xs.append(x)
        ys.append(motion.torque_Nm)
    scaled = [x / s for x, s in zip(xs, level, strict=True)]
    gram = np.sum([x.T @ x for x in scaled], axis=0)
    right = np.sum([x.T @ (y / s) for x, y, s in zip(scaled, ys, level, strict=True)], axis=0)
    size = np.sqrt(np.maximum(np.diag(gram), 1e-30))
    beta = np.linalg.solve(gram / np.outer(size, size) + 1e-9 * np.eye(4), right / size) / size
    return np.array([float(np.sum((y - x @ beta) ** 2)) for x, y in zip(xs, ys, strict=True)])

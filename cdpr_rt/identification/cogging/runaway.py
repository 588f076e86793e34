"""Stretches of a sweep in which the rotor does not follow the ramp."""

from __future__ import annotations

import numpy as np

from cdpr_rt.arrays import BoolArray, FloatArray
from cdpr_rt.identification.cogging.sweep import Stretch, period_s

_SPAN_rad = np.deg2rad(1.0)
_FAST = 4.0


def runaway(stretch: Stretch) -> BoolArray:
    """Return where the rotor ran away from the ramp, one flag a sample, (stop - start,).

    Two signs (Tremblay, section 1.4.2): the position error, and with it the proportional
    controller's torque, is of the sign that brakes; or the rotor covers `_SPAN_rad` at several
    times the ramp's speed or against it.
    """
    run, part = stretch.run, slice(stretch.start, stretch.stop)
    ahead = stretch.direction * (run.angle_rad[part] - run.setpoint_rad[part])
    wrong = ahead > _resolution(run.angle_rad[part])
    return np.asarray(wrong | _fast(stretch), np.bool_)


def _resolution(angle: FloatArray) -> float:
    """Return a few steps of the encoder, as the angles show them."""
    steps = np.abs(np.diff(angle))
    steps = steps[steps > 1e-9]
    return 2.0 * float(steps.min()) if steps.size else 0.0


def _fast(stretch: Stretch) -> BoolArray:
    """Return where the rotor's speed over a short way is far from the ramp's."""
    run = stretch.run
    span = _SPAN_rad / abs(stretch.velocity_rad_s)
    half = max(1, round(0.5 * span / _FAST / period_s(run)))
    angle = run.angle_rad[stretch.start : stretch.stop]
    before = np.concatenate([np.full(half, angle[0]), angle[:-half]])
    after = np.concatenate([angle[half:], np.full(half, angle[-1])])
    travelled = stretch.direction * (after - before)
    fast = (travelled > _SPAN_rad) | (travelled < -0.5 * _SPAN_rad)
    grown = np.convolve(fast, np.ones(2 * half + 1), mode="same") > 0.5
    return np.asarray(grown, np.bool_)

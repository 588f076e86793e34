"""The picture of a winch's calibration: torque over tension, and the residuals of the fit."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from cdpr_profiles.winch_calibration import WinchCalibration
from cdpr_rt.identification.tension_gain import TorquePoint
from cdpr_tools.style import BACKWARD, FORWARD, canvas, legend_above, save_figure

_SIDES = ((True, FORWARD, "winding in", 1.0), (False, BACKWARD, "paying out", -1.0))


def draw_calibration(path: Path, points: Sequence[TorquePoint], found: WinchCalibration) -> None:
    """Write the picture as PNG; raises OSError."""
    figure, (above, below) = canvas(2, height=2.6, sharex=True)
    line = np.array([0.0, 1.05 * max(point.tension_N for point in points)])
    for winding_in, colour, name, side in _SIDES:
        chosen = [point for point in points if point.winding_in is winding_in]
        tension = np.array([point.tension_N for point in chosen])
        torque = np.array([point.torque_Nm for point in chosen])
        fitted = [found.torque_Nm(t) + side * found.friction_at_Nm(t) for t in tension]
        ends = [found.torque_Nm(t) + side * found.friction_at_Nm(t) for t in line]
        above.plot(tension, torque, "o", ms=3.5, color=colour, label=name)
        above.plot(line, ends, color=colour, lw=0.9)
        below.plot(tension, 1e3 * (torque - fitted), "o", ms=3.5, color=colour)
    label = f"gain {1e3 * found.gain_m:.2f} mNm/N"
    above.plot(line, [found.torque_Nm(t) for t in line], "--", color="#444444", label=label)
    above.set(ylabel="motor torque (Nm)")
    below.axhline(0.0, color="#777777", lw=0.8)
    below.set(xlabel="cable tension (N)", ylabel="residual (mNm)", xlim=line)
    legend_above(figure, above)
    save_figure(figure, path)

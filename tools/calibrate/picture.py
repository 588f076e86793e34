"""The picture of a calibration: where exit points moved, what lengths still contradict."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cdpr_rt.calibration.outcome import Outcome
from cdpr_rt.calibration.residuals import length_std_m
from cdpr_tools.report.style import BACKWARD, FORWARD, canvas, legend_above


def draw(path: Path, outcome: Outcome) -> None:
    """Write the picture as PNG; raises OSError."""
    found, geometry = outcome.found, outcome.found.geometry
    figure, (above, below) = canvas(2, height=2.7)
    k, n = geometry.coordinates, geometry.n
    exits = [i for i, row in enumerate(geometry.rows) if row < 3]
    std = found.std[: n * len(geometry.rows)].reshape(n, -1)
    width = 0.8 / max(k, 1)
    for place, column in enumerate(exits):
        at = np.arange(n) + (place - 0.5 * (len(exits) - 1)) * width
        above.bar(
            at, 1e3 * geometry.cable[:, place], width, yerr=2e3 * std[:, column], capsize=2,
            label="xyz"[place], color=(FORWARD, BACKWARD, "#8a8f98")[place],
        )  # fmt: skip
    above.set(ylabel="moved (mm, ± 2 sigma)", xlabel="cable")
    above.set_xticks(range(n), [str(i + 1) for i in range(n)])
    off_mm = 1e3 * found.length_residual_m * length_std_m(geometry, found.seen)
    poses = np.arange(1, found.seen.poses + 1)
    for i in range(n):
        used = found.seen.used[:, i]
        below.plot(poses[used], off_mm[used, i], "o", ms=2.5, color=FORWARD)
    below.plot([], [], "o", ms=2.5, color=FORWARD, label="length left by the fit")
    for (cable, pose), size in zip(found.seen.jumps, found.jumps_m, strict=True):
        label = f"cable {cable + 1} jumped by {1e3 * size:+.1f} mm"
        below.axvline(pose + 0.5, color=BACKWARD, lw=0.9, label=label)
    below.axhline(0.0, color="#777777", lw=0.8)
    below.set(xlabel="pose", ylabel="length off (mm)")
    legend_above(figure, above, below)
    figure.savefig(path, format="png")

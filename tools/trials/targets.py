"""The trial of the robot alone at its targets: where it truly stands when it should be there."""

from __future__ import annotations

from typing import Final

import numpy as np

from cdpr_rt.exchange import FloatArray
from tools.trials.figures import Figure
from tools.trials.recorded import Recorded
from tools.trials.run import TrialRun

SETTLE_S: Final = 1.5
"""From the end of the set-point's motion until the platform is looked at."""
LOOK_S: Final = 0.1
"""The thesis takes the mean of ten samples at 100 Hz (section 2.5.2)."""
MEAN_mm: Final = 0.3
THREE_SIGMA_mm: Final = 1.0


def drive(run: TrialRun, seconds: float) -> None:
    """Go from target to target, stay for a moment at each."""
    while run.elapsed_s < seconds:
        target = run.head_anywhere()
        run.mark("target", target_m=target.tolist())
        run.arrive()
        run.stay(SETTLE_S)
        run.mark("measured", target_m=target.tolist())


def errors_mm(recorded: Recorded) -> tuple[FloatArray, FloatArray]:
    """Return the targets in m and what the true position was off there in mm, (k, 2) each."""
    marks = recorded.marked("measured")
    targets = np.array([mark["target_m"] for mark in marks]).reshape(-1, 2)
    looked = max(1, round(LOOK_S / recorded.period_s))
    rows = [recorded.row(mark["cycle"]) for mark in marks]
    true = [recorded.true_m[row - looked + 1 : row + 1].mean(axis=0) for row in rows]
    return targets, 1e3 * (np.array(true).reshape(-1, 2) - targets)


def judge(recorded: Recorded) -> list[Figure]:
    """Return mean and 3 sigma of the errors in both directions."""
    targets, errors = errors_mm(recorded)
    mean, spread = errors.mean(axis=0), 3.0 * errors.std(axis=0, ddof=1)
    figures = [Figure("targets", "targets", len(targets))]
    for i, axis in enumerate("xy"):
        figures.append(
            Figure(
                f"mean_{axis}_mm",
                f"mean error in {axis}, magnitude",
                abs(float(mean[i])),
                "mm",
                MEAN_mm,
            )
        )
    for i, axis in enumerate("xy"):
        figures.append(
            Figure(
                f"three_sigma_{axis}_mm",
                f"3 sigma in {axis}",
                float(spread[i]),
                "mm",
                THREE_SIGMA_mm,
            )
        )
    worst = float(np.linalg.norm(errors, axis=1).max())
    figures.append(Figure("worst_mm", "worst distance from a target", worst, "mm"))
    return figures

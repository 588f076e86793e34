"""The trial of accuracy at targets: the true position when the platform should be there."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_tools.trials.figures import Figure
from cdpr_tools.trials.recorded import Recorded
from cdpr_tools.trials.run import TrialRun

SETTLE_S: Final = 1.5
"""Time from the end of the set-point's motion until the platform's position is evaluated."""
LOOK_S: Final = 0.1
"""Time over which the position is averaged: the thesis takes ten samples at 100 Hz (2.5.2)."""
MEAN_mm: Final = {2: 0.3, 3: 0.5}
"""Limit of the mean error, by the number of coordinates of a position."""
THREE_SIGMA_mm: Final = {2: 1.0, 3: 1.5}
MEAN_deg: Final = 0.05
THREE_SIGMA_deg: Final = 0.15


def drive(run: TrialRun, seconds: float) -> None:
    """Move from target to target, and stay for a moment at each."""
    while run.elapsed_s < seconds:
        target = run.directions.marked(run.start_random_move(), "target")
        run.mark("target", **target)
        run.arrive()
        run.stay(SETTLE_S)
        run.mark("measured", **target)


def errors_mm(recorded: Recorded) -> tuple[FloatArray, FloatArray]:
    """Return the targets in m and the true position errors there in mm, (m, k) each."""
    k = recorded.directions.k
    targets = _targets(recorded)[:, :k]
    true = [recorded.true_m[rows].mean(axis=0) for rows in _looked(recorded)]
    return targets, 1e3 * (np.array(true).reshape(-1, k) - targets)


def errors_deg(recorded: Recorded) -> FloatArray:
    """Return the rotation vectors of R_true R_target^T, (m, 3) in degrees.

    (0, 3) if the platform's angles are not controlled.
    """
    directions = recorded.directions
    if not directions.turns:
        return np.zeros((0, 3))
    rotations = directions.rotations(_targets(recorded))
    turned = [
        directions.turn_between(target, recorded.truth["rotation"][rows]).mean(axis=0)
        for target, rows in zip(rotations, _looked(recorded), strict=True)
    ]
    return np.degrees(turned).reshape(-1, 3)


def _measured(recorded: Recorded) -> list[dict[str, Any]]:
    return recorded.marked("measured")


def _targets(recorded: Recorded) -> FloatArray:
    directions = recorded.directions
    places = [directions.place(mark, "target") for mark in _measured(recorded)]
    return np.array(places).reshape(-1, directions.d)


def _looked(recorded: Recorded) -> list[slice]:
    """Return for each target the rows over which the mean is taken."""
    looked = max(1, round(LOOK_S / recorded.period_s))
    rows = [recorded.row(mark["cycle"]) for mark in _measured(recorded)]
    return [slice(row - looked + 1, row + 1) for row in rows]


def judge(recorded: Recorded) -> list[Figure]:
    """Return mean and 3 sigma of the errors in each direction."""
    names, k = recorded.directions.names, recorded.directions.k
    targets, errors = errors_mm(recorded)
    mean, spread = errors.mean(axis=0), 3.0 * errors.std(axis=0, ddof=1)
    figures = [Figure("targets", "targets", len(targets))]
    for i, name in enumerate(names[:k]):
        text, value = f"mean error in {name}, magnitude", abs(float(mean[i]))
        figures.append(Figure(f"mean_{name}_mm", text, value, "mm", MEAN_mm[k]))
    for i, name in enumerate(names[:k]):
        text, value = f"3 sigma in {name}", float(spread[i])
        figures.append(Figure(f"three_sigma_{name}_mm", text, value, "mm", THREE_SIGMA_mm[k]))
    worst = float(np.linalg.norm(errors, axis=1).max())
    figures.append(Figure("worst_mm", "worst distance from a target", worst, "mm"))
    return [*figures, *_orientation(errors_deg(recorded))]


def _orientation(errors: FloatArray) -> list[Figure]:
    """Return the figures of the rotation vectors (m, 3) from target to true orientation.

    The mean is the length of the mean vector; 3 sigma is that of the worst axis.
    """
    if not len(errors):
        return []
    angle = np.linalg.norm(errors, axis=1)
    mean, spread = np.linalg.norm(errors.mean(axis=0)), 3.0 * errors.std(axis=0, ddof=1).max()
    values = {
        "orientation_error_deg": ("mean error in orientation, magnitude", mean, MEAN_deg),
        "orientation_three_sigma_deg": (
            "3 sigma in orientation, worst axis", spread, THREE_SIGMA_deg,
        ),
        "orientation_worst_deg": ("worst error in orientation", angle.max(), None),
    }  # fmt: skip
    return [
        Figure(key, text, float(value), "deg", limit)
        for key, (text, value, limit) in values.items()
    ]

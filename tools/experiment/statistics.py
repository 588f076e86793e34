"""The experiment's tables and its analysis of variance, computed from confirmed targets."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import Any, Final

import numpy as np
from scipy import stats

from cdpr_rt.arrays import FloatArray
from cdpr_tools.experiment import thesis
from cdpr_tools.experiment.points import Points

RUN = ["place", "scale", "round_trip_s", "repeat"]
"""What names a run along the path."""
GOAL_SHARE: Final = 0.5
"""The 3 sigma that is wanted, of the thesis' in the same row."""
PARTS: Final = ("judged_m", "hand_m", "robot_m")
_COLUMN: Final = {
    thesis.OPERATION: "round_trip_s",
    thesis.SCALE: "scale",
    thesis.PLACE: "place",
}


def levels(points: Points, variable: str) -> Iterator[tuple[str, Any, Points]]:
    """Yield each level of a variable: its name, its value and the targets under it."""
    column = _COLUMN[variable]
    for value in np.unique(points[column]):
        yield level_name(variable, value), value, points[points[column] == value]


def level_name(variable: str, value: Any) -> str:
    """Return what a level is called: `350 ms`, `8:1`, `A`."""
    if variable == thesis.OPERATION:
        return f"{1e3 * value:.0f} ms"
    return f"{value:g}:1" if variable == thesis.SCALE else str(value)


def thesis_row(variable: str, value: Any) -> thesis.Row | None:
    """Return the thesis' row of a level, None where it has none."""
    name = level_name(variable, value)
    if variable == thesis.OPERATION:
        name = next(
            (key for key, s in thesis.ROUND_TRIPS_S.items() if math.isclose(s, value)), name
        )
    rows = (row for row in thesis.ROWS if (row.variable, row.level) == (variable, name))
    return next(rows, None)


def spread_mm(errors_m: FloatArray) -> FloatArray:
    """Return three standard deviations of x and y, (2,) in mm, of errors (k, 2) in m."""
    return np.asarray(3e3 * np.std(errors_m, axis=0, ddof=1))


def run_times_s(points: Points) -> FloatArray:
    """Return how long each run took, from its begin to its last confirmation, (runs,)."""
    _, which = np.unique(points[RUN], return_inverse=True)
    times = np.zeros(which.max() + 1)
    np.maximum.at(times, which, points["pressed_s"])
    return times


def rows(points: Points) -> list[dict[str, Any]]:
    """Return tables 2.1 and 2.2 in one, a row for each level of each variable."""
    return [
        _row(variable, name, value, inside)
        for variable in _COLUMN
        for name, value, inside in levels(points, variable)
    ]


def _row(variable: str, name: str, value: Any, points: Points) -> dict[str, Any]:
    times = run_times_s(points)
    spread = spread_mm(points["error_m"])
    beside = thesis_row(variable, value)
    row: dict[str, Any] = {
        "variable": variable,
        "level": name,
        "targets": len(points),
        "runs": len(times),
        "mean_mm": (1e3 * points["error_m"].mean(axis=0)).tolist(),
        "three_sigma_mm": spread.tolist(),
        "time_s": float(times.mean()),
        "time_sigma_s": float(times.std(ddof=1)) if len(times) > 1 else float("nan"),
        "parts_three_sigma_mm": {
            part.removesuffix("_m"): spread_mm(points[part]).tolist() for part in PARTS
        },
        "following_mean_mm": (1e3 * points["following_m"].mean(axis=0)).tolist(),
        "following_three_sigma_mm": spread_mm(points["following_m"]).tolist(),
    }
    if beside is not None:
        thesis = asdict(beside)
        row["thesis"] = {key: thesis[key] for key in thesis if key != "variable"}
        goal = GOAL_SHARE * np.array(beside.three_sigma_mm)
        row["share_of_thesis"] = (spread / beside.three_sigma_mm).tolist()
        row["reached"] = bool(np.all(spread <= goal))
    return row


def variance_analysis(points: Points) -> list[dict[str, Any]]:
    """Return a one-way analysis of variance of the errors' norms for each variable.

    `p` is the chance of such differences of the mean where there is none; `differs` says whether it
    is below 5 %. A variable with one level only has none.
    """
    norm_mm = 1e3 * np.linalg.norm(points["error_m"], axis=1)
    found = []
    for variable, column in _COLUMN.items():
        groups = [norm_mm[points[column] == value] for value in np.unique(points[column])]
        if len(groups) > 1:
            found.append(_one_way(variable, groups))
    return found


def _one_way(variable: str, groups: Sequence[FloatArray]) -> dict[str, Any]:
    result = stats.f_oneway(*groups)
    return {
        "variable": variable,
        "F": float(result.statistic),
        "p": float(result.pvalue),
        "degrees_of_freedom": [len(groups) - 1, sum(map(len, groups)) - len(groups)],
        "mean_norm_mm": [float(group.mean()) for group in groups],
        "differs": bool(result.pvalue < thesis.P_LIMIT),
        "differs_in_thesis": thesis.SIGNIFICANT[variable],
    }

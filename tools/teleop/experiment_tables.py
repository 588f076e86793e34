"""The experiment's tables, analysis of variance and pictures, compared with the thesis'."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy import stats

from cdpr_rt.arrays import FloatArray
from cdpr_tools.bench.harness import table
from cdpr_tools.output import TableText
from cdpr_tools.style import SERIES, legend_above, save_figure
from cdpr_tools.teleop.experiment_trial import Points


class ThesisRow(NamedTuple):
    """A row of Tremblay (thesis), tables 2.1 and 2.2: x and y in mm, times in s.

    The sigma of the time is over the runs.
    """

    level: str
    mean_mm: tuple[float, float]
    three_sigma_mm: tuple[float, float]
    time_s: float
    time_sigma_s: float


class Variable(NamedTuple):
    """A variable in which the conditions differ."""

    column: str
    """Column of the variable in the points."""
    name: str
    shown: str
    """Format of a level."""
    differs_in_thesis: bool
    """Whether the mean norm of the errors differs between its levels (section 2.8, at 95 %)."""
    thesis: Mapping[Any, ThesisRow]
    """The thesis' rows by the level's value."""
    picture: str

    def level(self, value: Any) -> str:
        """Return the name of a level: `350 ms`, `8:1`, `A`."""
        return self.shown.format(1e3 * value if self.column == "round_trip_s" else value)


OPERATION, SCALE, PLACE = "operation", "scale", "place"
# Section 2.7 gives the round trips. The manual trials had no robot and hardly any delay, so they
# are compared with a round trip of 0 s.
VARIABLES: Final = {
    OPERATION: Variable("round_trip_s", "round trip", "{:.0f} ms", True, {
        0.0: ThesisRow("manual", (0.000, -0.070), (3.61, 3.03), 47.5, 3.6),
        0.73: ThesisRow("remote", (-0.343, 0.193), (4.31, 3.39), 89.0, 11.5),
        0.35: ThesisRow("on site", (-1.059, 0.083), (3.83, 3.84), 39.9, 5.4),
    }, "figure-2.10.png"),
    SCALE: Variable("scale", "scale", "{:g}:1", True, {
        8.0: ThesisRow("8:1", (-0.704, 0.261), (5.30, 4.87), 63.4, 26.2),
        4.0: ThesisRow("4:1", (-0.826, 0.005), (3.96, 3.36), 58.5, 24.4),
        2.0: ThesisRow("2:1", (-0.413, 0.087), (3.32, 2.39), 64.4, 26.6),
    }, "figure-2.11.png"),
    PLACE: Variable("place", "place", "{}", False, {
        "A": ThesisRow("A", (-0.632, 0.199), (3.86, 3.08), 65.1, 26.7),
        "B": ThesisRow("B", (-0.624, 0.286), (4.17, 3.51), 61.4, 26.7),
        "C": ThesisRow("C", (-0.604, -0.210), (4.58, 3.90), 61.0, 24.0),
    }, "figure-2.12.png"),
}  # fmt: skip
_P_LIMIT: Final = 0.05
_RUN = ["place", "scale", "round_trip_s", "repeat"]
"""The columns that identify a run along the path."""
_GOAL_SHARE: Final = 0.5
"""Largest 3 sigma wanted, as a share of the thesis' in the same row."""
_PARTS: Final = ("judged_m", "hand_m", "robot_m")


def levels(points: Points, of: Variable) -> dict[Any, Points]:
    """Return the targets of each level of a variable, by the level's value."""
    column = points[of.column]
    return {value.item(): points[column == value] for value in np.unique(column)}


def spread_mm(errors_m: FloatArray) -> FloatArray:
    """Return three standard deviations of x and y, (2,) in mm, of errors (k, 2) in m."""
    return np.asarray(3e3 * np.std(errors_m, axis=0, ddof=1))


def run_times_s(points: Points) -> FloatArray:
    """Return the time of each run, from its start to its last confirmation, (runs,)."""
    _, which = np.unique(points[_RUN], return_inverse=True)
    times = np.zeros(which.max() + 1)
    np.maximum.at(times, which, points["pressed_s"])
    return times


def rows(points: Points) -> list[dict[str, Any]]:
    """Return tables 2.1 and 2.2 combined, with a row for each level of each variable."""
    return [
        {"variable": variable, "level": of.level(value)} | _row(inside, of.thesis.get(value))
        for variable, of in VARIABLES.items()
        for value, inside in levels(points, of).items()
    ]


def _row(points: Points, thesis: ThesisRow | None) -> dict[str, Any]:
    times = run_times_s(points)
    spread = spread_mm(points["error_m"])
    row: dict[str, Any] = {
        "targets": len(points),
        "runs": len(times),
        "mean_mm": (1e3 * points["error_m"].mean(axis=0)).tolist(),
        "three_sigma_mm": spread.tolist(),
        "time_s": float(times.mean()),
        "time_sigma_s": float(times.std(ddof=1)) if len(times) > 1 else float("nan"),
        "parts_three_sigma_mm": {
            part.removesuffix("_m"): spread_mm(points[part]).tolist() for part in _PARTS
        },
        "following_mean_mm": (1e3 * points["following_m"].mean(axis=0)).tolist(),
        "following_three_sigma_mm": spread_mm(points["following_m"]).tolist(),
    }
    if thesis is not None:
        share = spread / thesis.three_sigma_mm
        row["thesis"] = thesis._asdict()
        row["share_of_thesis"] = share.tolist()
        row["reached"] = bool(np.all(share <= _GOAL_SHARE))
    return row


def variance_analysis(points: Points) -> list[dict[str, Any]]:
    """Return a one-way analysis of variance of the errors' norms for each variable.

    `p` is the probability of such differences if the true means are equal; `differs` says whether
    it is below 5 %. A variable with only one level is left out.
    """
    found = []
    for variable, of in VARIABLES.items():
        groups = [
            1e3 * np.linalg.norm(inside["error_m"], axis=1)
            for inside in levels(points, of).values()
        ]
        if len(groups) > 1:
            result = stats.f_oneway(*groups)
            found.append({
                "variable": variable,
                "F": float(result.statistic),
                "p": float(result.pvalue),
                "degrees_of_freedom": [len(groups) - 1, len(points) - len(groups)],
                "mean_norm_mm": [float(group.mean()) for group in groups],
                "differs": bool(result.pvalue < _P_LIMIT),
                "differs_in_thesis": of.differs_in_thesis,
            })  # fmt: skip
    return found


def lines(result: dict[str, Any]) -> list[str]:
    """Return the result as lines of text."""
    rows, alone = result["rows"], result.get("operator_alone")
    none = {"mean_mm": [], "three_sigma_mm": [], "time_s": math.nan, "time_sigma_s": math.nan}
    pairs = [(row, row.get("thesis", none)) for row in rows]
    names = [f"{VARIABLES[row['variable']].name} {row['level']}" for row in rows]
    shown = [
        "Errors at the confirmed targets, mm (Tremblay, table 2.1): means and 3 sigma, those of "
        "the thesis, and the share of its 3 sigma",
        _table([*_xy("mean", "3 sigma", "thesis", "3 sigma", "share"), ""], rows, [
            [*row["mean_mm"], *row["three_sigma_mm"], *thesis["mean_mm"],
             *thesis["three_sigma_mm"], *row.get("share_of_thesis", ()),
             *([] if row.get("reached", True) else ["above half"])]
            for row, thesis in pairs
        ]),
        "",
        "Time for the path, s (Tremblay, table 2.2)",
        _table(["mean", "sigma", "thesis", "sigma", "runs"], rows, [
            [row["time_s"], row["time_sigma_s"], thesis["time_s"], thesis["time_sigma_s"],
             row["runs"]]
            for row, thesis in pairs
        ]),
        "",
    ]  # fmt: skip
    if alone is not None:
        shown += [
            "Where the errors come from, 3 sigma, mm: judged = the error that the operator "
            "accepted; hand, robot = their motion after that; then the same operator's total "
            "with an ideal robot, and the distance from the set-point",
            _table(_xy("judged", "hand", "robot", "total", "perfect", "off"), rows, [
                [*(value for part in row["parts_three_sigma_mm"].values() for value in part),
                 *row["three_sigma_mm"], *ideal["three_sigma_mm"],
                 *row["following_three_sigma_mm"]]
                for row, ideal in zip(rows, alone, strict=True)
            ]),
            "",
        ]  # fmt: skip
    shown.append("Does the mean norm of the errors differ? (one-way analysis of variance, 95 %)")
    for one in result["variance_analysis"]:
        groups, targets = one["degrees_of_freedom"]
        means = ", ".join(f"{value:.2f}" for value in one["mean_norm_mm"])
        shown.append(
            f"{VARIABLES[one['variable']].name:12}F({groups}, {targets}) = {one['F']:.2f}, "
            f"p = {one['p']:.2g}: {'yes' if one['differs'] else 'no'} "
            f"(thesis: {'yes' if one['differs_in_thesis'] else 'no'}); means {means} mm"
        )
    missed = [name for name, row in zip(names, rows, strict=True) if not row.get("reached", True)]
    verdict = "at most half of the thesis' in every row"
    if missed:
        verdict = f"above half of the thesis': {', '.join(missed)}"
    return [*shown, "", f"3 sigma {verdict}"]


def _xy(*names: str) -> list[str]:
    return [f"{name} {x}" for name in names for x in "xy"]


def _table(
    columns: Sequence[str], rows: Sequence[dict[str, Any]], cells: Sequence[Sequence[object]]
) -> TableText:
    labels = []
    for row in rows:
        level, other = row["level"], row.get("thesis", row)["level"]
        other = "" if other == level else f"({other})"
        labels.append(f"{VARIABLES[row['variable']].name:11}{level:>7} {other}")
    return table(columns, zip(labels, cells, strict=True), digits=2)


_THESIS: Final = "#8a8f98"


def draw(points: Points, folder: Path) -> list[Path]:
    """Draw figures 2.10 to 2.12 of Tremblay (thesis) into a folder."""
    for of in VARIABLES.values():
        save_figure(errors(points, of), folder / of.picture)
    return [folder / of.picture for of in VARIABLES.values()]


def errors(points: Points, of: Variable) -> Figure:
    """Draw all errors, and mean and 3 sigma of each level beside those of the thesis."""
    figure = Figure(figsize=(7.4, 3.6), layout="constrained")
    cloud, *bars = figure.subplots(1, 3, width_ratios=(1.5, 1, 1))
    found = levels(points, of)
    for colour, (value, inside) in zip(SERIES, found.items(), strict=False):
        cloud.plot(*(1e3 * inside["error_m"].T), ".", ms=3.5, alpha=0.55, color=colour,
                   label=of.level(value))  # fmt: skip
    reach = 1.1 * max(1e3 * float(np.abs(points["error_m"]).max()), 1.0)
    cloud.set(xlim=(-reach, reach), ylim=(-reach, reach), xlabel="x (mm)", ylabel="y (mm)")
    cloud.set_aspect("equal")
    cloud.set_title(f"Error by {of.name}")
    for axis, ax in enumerate(bars):
        _bars(ax, axis, of, found)
    ends = [end for ax in bars for end in ax.get_ylim()]
    for ax in bars:
        ax.set_ylim(min(ends), max(ends))
    legend_above(figure, cloud, bars[0])
    return figure


def _bars(ax: Axes, axis: int, of: Variable, found: dict[Any, Points]) -> None:
    for k, (value, inside) in enumerate(found.items()):
        mean = 1e3 * inside["error_m"][:, axis].mean()
        spread = spread_mm(inside["error_m"])[axis]
        ax.errorbar(k - 0.15, mean, spread, fmt="o", ms=4, capsize=4, color=SERIES[k % len(SERIES)])
        if beside := of.thesis.get(value):
            ax.errorbar(k + 0.15, beside.mean_mm[axis], beside.three_sigma_mm[axis], fmt="s", ms=4,
                        capsize=4, color=_THESIS, label=None if k else "thesis")  # fmt: skip
    ax.axhline(0.0, color="black", lw=0.5)
    ax.set_xticks(range(len(found)), [of.level(value) for value in found])
    ax.set_xlim(-0.6, len(found) - 0.4)
    ax.set_title(f"{'xy'[axis]} (mm), 3 sigma")

"""The experiment's pictures (Tremblay, figures 2.8 and 2.10 to 2.12)."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cdpr_rt.arrays import FloatArray
from cdpr_tools.experiment import thesis
from cdpr_tools.experiment.points import Points
from cdpr_tools.experiment.statistics import PARTS, levels, spread_mm, thesis_row
from cdpr_tools.report.style import canvas, legend_above, save_figure

_OURS: Final = ("#2f6fb0", "#d1581a", "#3b8f5a", "#7a3fa0")
_THESIS: Final = "#8a8f98"
_PICTURES: Final = {
    "figure-2.10.png": (thesis.OPERATION, "Error by round trip"),
    "figure-2.11.png": (thesis.SCALE, "Error by scale"),
    "figure-2.12.png": (thesis.PLACE, "Error by place"),
}
_SHARES: Final = {
    "judged_m": "judged",
    "hand_m": "hand, since",
    "robot_m": "robot, since",
}


def draw(points: Points, alone: Points, folder: Path) -> list[Path]:
    """Draw all pictures into a folder; `alone` is the same operator with a perfect robot."""
    drawn = []
    for name, (variable, title) in _PICTURES.items():
        drawn.append(folder / name)
        save_figure(errors(points, variable, title), drawn[-1])
    drawn.append(folder / "parts.png")
    save_figure(parts(points, alone), drawn[-1])
    return drawn


def errors(points: Points, variable: str, title: str) -> Figure:
    """Draw all errors, and mean and 3 sigma of each level with the thesis' beside them."""
    figure = Figure(figsize=(7.4, 3.6), layout="constrained")
    cloud, bars_x, bars_y = figure.subplots(1, 3, width_ratios=(1.5, 1, 1))
    found = list(levels(points, variable))
    for colour, (name, _, inside) in zip(_OURS, found, strict=False):
        cloud.plot(*(1e3 * inside["error_m"].T), ".", ms=3.5, alpha=0.55, color=colour, label=name)
    reach = 1.1 * max(1e3 * float(np.abs(points["error_m"]).max()), 1.0)
    cloud.set(xlim=(-reach, reach), ylim=(-reach, reach), xlabel="x (mm)", ylabel="y (mm)")
    cloud.set_aspect("equal")
    cloud.set_title(title)
    for axis, ax in enumerate((bars_x, bars_y)):
        _bars(ax, axis, variable, found)
    ends = [end for bars in (bars_x, bars_y) for end in bars.get_ylim()]
    for bars in (bars_x, bars_y):
        bars.set_ylim(min(ends), max(ends))
    legend_above(figure, cloud, bars_x)
    return figure


def _bars(ax: Axes, axis: int, variable: str, found: list[tuple[str, object, Points]]) -> None:
    for k, (_, value, inside) in enumerate(found):
        mean = 1e3 * inside["error_m"][:, axis].mean()
        spread = spread_mm(inside["error_m"])[axis]
        ax.errorbar(
            k - 0.15, mean, spread, fmt="o", ms=4, capsize=4, color=_OURS[k % len(_OURS)]
        )  # fmt: skip
        beside = thesis_row(variable, value)
        if beside is not None:
            ax.errorbar(
                k + 0.15, beside.mean_mm[axis], beside.three_sigma_mm[axis],
                fmt="s", ms=4, capsize=4, color=_THESIS,
                label="thesis" if k == 0 else None,
            )  # fmt: skip
    ax.axhline(0.0, color="black", lw=0.5)
    ax.set_xticks(range(len(found)), [name for name, _, _ in found])
    ax.set_xlim(-0.6, len(found) - 0.4)
    ax.set_title(f"{'xy'[axis]} (mm), 3 sigma")


def parts(points: Points, alone: Points) -> Figure:
    """Draw the share of operator, hand and robot in the variance, level by level."""
    figure, axes = canvas(columns=2, height=3.6, sharey=True)
    names = [f"{name}" for variable in _variables() for name, _, _ in levels(points, variable)]
    for axis, ax in enumerate(axes):
        left = np.zeros(len(names))
        for part, colour in zip(PARTS, _OURS, strict=False):
            share = np.array([
                float(np.var(1e3 * inside[part][:, axis], ddof=1))
                for variable in _variables()
                for _, _, inside in levels(points, variable)
            ])  # fmt: skip
            ax.barh(np.arange(len(names)), share, left=left, color=colour, label=_SHARES[part])
            left += share
        for k, inside in enumerate(_in_turn(points)):
            total = np.var(1e3 * inside["error_m"][:, axis], ddof=1)
            label = "total" if k == 0 else None
            ax.plot(total, k, "k|", ms=11, mew=2, label=label)
        for k, inside in enumerate(_in_turn(alone)):
            total = np.var(1e3 * inside["error_m"][:, axis], ddof=1)
            label = "total with a perfect robot" if k == 0 else None
            ax.plot(total, k, "D", ms=4, color="#222222", mfc="none", label=label)
        ax.set_yticks(range(len(names)), names)
        ax.set(xlabel=f"variance in {'xy'[axis]} (mm²)")
    axes[0].invert_yaxis()
    legend_above(figure, axes[0])
    return figure


def _variables() -> tuple[str, ...]:
    return tuple(variable for variable, _ in _PICTURES.values())


def _in_turn(points: Points) -> Iterator[Points]:
    for variable in _variables():
        for _, _, inside in levels(points, variable):
            yield inside


def path(targets: FloatArray, track: FloatArray) -> Figure:
    """Draw the targets (k, 2) in their order, from where it ends, and one run's true way (n, 2)."""
    figure, (ax,) = canvas(height=4.0)
    way = 1e3 * np.vstack([targets[-1], targets])
    half = len(targets) // 2
    for k, (begin, end) in enumerate(pairwise(way)):
        arrow = {"arrowstyle": "->", "color": _OURS[k >= half], "lw": 1.5}
        ax.annotate("", end, begin, arrowprops=arrow)
        ax.annotate(str(k + 1), end, (6, 6 if k < half else -13), textcoords="offset points")
    ax.plot(*(1e3 * track.T), color=_THESIS, lw=0.8, label="the platform's true way in one run")
    ax.plot(*way[0], "o", ms=12, mfc="none", mew=2, color=_OURS[2], label="begin and end")
    ax.set(xlabel="x (mm)", ylabel="y (mm)")
    ax.set_aspect("equal")
    ax.margins(0.12)
    legend_above(figure, ax)
    return figure

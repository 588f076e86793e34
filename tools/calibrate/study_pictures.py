"""Pictures of `cdpr calibrate study`: the thesis' figures 3.7, 3.8, B.1 to B.6, C.1 to C.6."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cdpr_tools.calibrate.study import FIGURES, PAIRS, plateaus
from cdpr_tools.report.style import BACKWARD, FORWARD, canvas, legend_above, save_figure

_Rows = list[dict[str, Any]]
_ENDS: Final = (("exit", FORWARD, "exit points a"), ("offset", BACKWARD, "initial lengths ρ_0"))
_UNITS: Final = {
    "length": ("length_mm", "lengths (mm)"),
    "position": ("position_mm", "position (mm)"),
    "rotation": ("rotation_deg", "rotation (deg)"),
}


def draw(path: Path, rows: _Rows) -> list[Path]:
    """Write NAME.png, NAME-B.png and NAME-C.png, and return their paths."""
    drawn = {"": _counted(rows), "-B": _compared(rows), "-C": _paired(rows)}
    paths = [path.with_stem(path.stem + end) for end in drawn]
    for one, figure in zip(paths, drawn.values(), strict=True):
        save_figure(figure, one)
    return paths


def _counted(rows: _Rows) -> Figure:
    """Draw figures 3.7 and 3.8: errors by the number of poses, and the floor they come down to."""
    figure, axes = canvas(1, 2, height=3.4)
    for ax, name, plateau in zip(axes, FIGURES, plateaus(rows), strict=True):
        points = [row for row in rows if row["figure"] == name]
        _errors(ax, points, "poses")
        for key, colour, label in _ENDS:
            ax.axhline(plateau[f"floor_{key}_mm"], color=colour, ls=":",
                       label=f"{label}, floor")  # fmt: skip
        ax.set(xlabel="poses", ylabel="RMS error (mm)", title=f"as figure {name}")
    legend_above(figure, axes[0], columns=3)
    return figure


def _compared(rows: _Rows) -> Figure:
    """Draw figures B.1 to B.6: errors by a bias or noise, and how far trials are off the model."""
    figure, axes = canvas(4, 3, height=2.3)
    for k in range(6):
        name, what = list(_UNITS.values())[k % 3]
        points = [row for row in rows if row["figure"] == f"B.{k + 1}"]
        top, bottom = axes[k % 3 + 6 * (k // 3)], axes[k % 3 + 6 * (k // 3) + 3]
        _errors(top, points, name)
        for key, colour, _ in _ENDS:
            there = [row for row in points if row[f"off_{key}"] is not None]
            off = [100 * row[f"off_{key}"] for row in there]
            bottom.plot([row[name] for row in there], off, "o-", ms=3, color=colour)
        bottom.axhspan(-20, 20, color="#888888", alpha=0.12)
        kind = "bias" if k < 3 else "noise"
        bottom.set(xscale="log", xlabel=f"{kind} of {what}")
        top.set_title(f"as figure B.{k + 1}")
        if k % 3 == 0:
            top.set_ylabel("RMS error (mm)")
            bottom.set_ylabel("trial over model (%)")
    legend_above(figure, axes[2], columns=4)
    return figure


def _errors(ax: Axes, rows: _Rows, by: str) -> None:
    """Draw errors of trials and by the model, those that there are, on logarithmic axes."""
    for key, colour, label in _ENDS:
        points = [row for row in rows if row[f"off_{key}"] is not None]
        if points:
            x = [row[by] for row in points]
            ax.plot(x, [row[f"{key}_mm"] for row in points], "o", ms=4, color=colour,
                    label=f"{label}, trial")  # fmt: skip
            ax.plot(x, [row[f"predicted_{key}_mm"] for row in points], color=colour,
                    label=f"{label}, model")  # fmt: skip
    ax.set(xscale="log", yscale="log")


def _paired(rows: _Rows) -> Figure:
    """Draw figures C.1 to C.6: errors by noise of two kinds, and trials over the model in %.

    By the model squares of errors add, and each is proportional to its noise.
    """
    figure, axes = canvas(3, 2, height=2.7)
    for k, (title, pair) in enumerate(PAIRS.items()):
        points = [row for row in rows if row["figure"] == title]
        (x, x_label), (y, y_label) = (_UNITS[one] for one in pair)
        for ax, (key, _, label), name in zip(axes[2 * k :], _ENDS, title.split(", "), strict=False):
            units = [_at_bound(rows, one)[f"predicted_{key}_mm"] for one in pair]
            most = [_at_bound(rows, one)[at] for one, at in zip(pair, (x, y), strict=True)]
            shares = np.linspace(0.0, 1.15, 60)
            errors = np.hypot(units[0] * shares, units[1] * shares[:, None])
            drawn = ax.contourf(most[0] * shares, most[1] * shares, errors, 10, cmap="Blues")
            figure.colorbar(drawn, ax=ax, label="RMS error (mm)")
            for row in points:
                ax.text(row[x], row[y], f"{100 * row[f'off_{key}']:+.0f} %", fontsize=7,
                        ha="center", va="center",
                        bbox={"boxstyle": "round", "fc": "white", "ec": "none"})  # fmt: skip
            ax.set(xlabel=f"noise of {x_label}", ylabel=f"noise of {y_label}")
            ax.set_title(f"as figure {name}: {label}")
            ax.grid(visible=False)
    return figure


def _at_bound(rows: _Rows, name: str) -> dict[str, Any]:
    """Return the row of one kind of noise alone, at the bound of table 3.1."""
    return next(row for row in rows if row["name"] == name and row["share"] == 1.0)

"""Style of the reports' pictures."""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from cdpr_rt.arrays import FloatArray
from cdpr_tools.saving import OWN_MARK, save

COLOURS = {"none": "#8a8f98", "thesis": "#2f6fb0", "harmonic": "#d1581a", "floor": "#3b8f5a"}
LABELS = {
    "none": "no compensation",
    "thesis": "thesis' method",
    "harmonic": "harmonic model",
    "floor": "floor: encoder and torque steps",
}
SERIES = (
    "#2f6fb0", "#d1581a", "#3b8f5a", "#7a3fa0", "#1f8a8a", "#b03a5b", "#8a6d1f", "#8a8f98",
)  # fmt: skip
"""Colours of axes, coordinates and other numbered curves."""
BOUND, BOX, LINES = "#b02f2f", "#7a3fa0", "#444444"
FORWARD, BACKWARD = "#7a3fa0", "#1f8a8a"
REPAIRED = "#f3c623"
DIRECTIONS = ("increasing angle", "decreasing angle")

_POINTS = 4000

mpl.rcParams.update(
    {
        "savefig.dpi": 170,
        "font.size": 9.5,
        "axes.titlesize": 10,
        "axes.titlelocation": "left",
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.edgecolor": "#777777",
        "axes.grid": True,
        "grid.alpha": 0.25,
        "legend.frameon": False,
        "legend.fontsize": 8.5,
        "lines.linewidth": 1.1,
        "axes.formatter.useoffset": False,
    }
)


def canvas(
    rows: int = 1, columns: int = 1, height: float = 3.0, sharex: bool = False, sharey: bool = False
) -> tuple[Figure, list[Axes]]:
    """Return a figure of the report's width and its axes, row by row; `height` in inch per row."""
    figure = Figure(figsize=(7.4, height * rows), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False, sharex=sharex, sharey=sharey)
    return figure, [ax for row in axes for ax in row]


def save_figure(figure: Figure, path: Path, tight: bool = False) -> None:
    """Write a PNG as `save` does; if `tight`, its size includes everything outside the layout."""
    drawn = io.BytesIO()
    figure.savefig(
        drawn,
        format="png",
        bbox_inches="tight" if tight else None,
        metadata={"Software": OWN_MARK.decode()},
    )
    save(path, drawn.getvalue())


def label_view(ax: Axes, view: Sequence[int]) -> None:
    """Label the axes with the room's coordinates in m, and set equal scales."""
    i, j = view
    ax.set(xlabel=f"{'xyz'[i]} (m)", ylabel=f"{'xyz'[j]} (m)", aspect="equal")


def box_of_targets(
    ax: Axes,
    low_m: Sequence[float] | FloatArray,
    high_m: Sequence[float] | FloatArray,
    view: Sequence[int],
) -> None:
    """Draw in a view the box in which a robot's targets lie."""
    i, j = view
    size = high_m[i] - low_m[i], high_m[j] - low_m[j]
    box = Rectangle((low_m[i], low_m[j]), *size, fill=False, ec=BOX, lw=1.2, ls="--")
    box.set_label("box of targets")
    ax.add_patch(box)


def colour_bar(
    figure: Figure,
    shades: ScalarMappable,
    ax: Axes | Sequence[Axes],
    label: str,
    shrink: float = 0.8,
) -> None:
    """Add a colour bar with a label beside `ax`."""
    axes = ax if isinstance(ax, Axes) else list(ax)
    bar = figure.colorbar(shades, ax=axes, shrink=shrink, format="%g")
    bar.set_label(label)
    bar.outline.set_visible(False)


def legend_below(figure: Figure, *axes: Axes, columns: int) -> None:
    """Add a legend of `axes` below the figure."""
    named = [pair for ax in axes for pair in zip(*ax.get_legend_handles_labels(), strict=True)]
    handles, labels = zip(*named, strict=True)
    figure.legend(handles, labels, loc="outside lower center", ncols=columns)


def legend_above(figure: Figure, *axes: Axes, columns: int = 4) -> None:
    """Add a legend of `axes` above the figure, row by row, so that it hides nothing."""
    named = [pair for ax in axes for pair in zip(*ax.get_legend_handles_labels(), strict=True)]
    by_columns = [pair for column in range(columns) for pair in named[column::columns]]
    handles, labels = zip(*by_columns, strict=True)
    figure.legend(handles, labels, loc="outside upper left", ncols=columns)


def legend_beside_title(
    ax: Axes, columns: int = 3, handles: Sequence[Artist] | None = None
) -> None:
    """Add a legend of `ax`, or of `handles`, to the right of its title, so that it hides nothing.

    Set the title first: if there is too little room, it moves above the legend.
    """
    legend = ax.legend(
        handles=handles or ax.get_legend_handles_labels()[0],
        loc="lower right", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.0, ncols=columns,
        handlelength=1.2, columnspacing=1.0, fontsize=8.0,
    )  # fmt: skip
    if not (words := ax.get_title(loc="left")):
        return
    title = ax.set_title(words)
    figure = ax.get_figure(root=True)
    assert figure is not None
    figure.draw_without_rendering()  # only then are the sizes known
    named = legend.get_window_extent()
    if title.get_window_extent().overlaps(named):
        ax.set_title(words, pad=mpl.rcParams["axes.titlepad"] + 72.0 * named.height / figure.dpi)


def data_uri(figure: Figure) -> str:
    """Return the figure as a data URI, so that the page needs no other file."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png")
    figure.clear()
    return "data:image/png;base64," + base64.b64encode(buffer.getvalue()).decode()


def decimated(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return a curve (k,) reduced for drawing; both extremes of each stretch are kept.

    A gap (nan) is kept if it fills a stretch.
    """
    step = -(-2 * y.size // _POINTS)
    if step <= 2:
        return x, y
    blocks = np.pad(y, (0, -y.size % step), mode="edge").reshape(-1, step)
    unknown = np.isnan(blocks)
    lowest = np.where(unknown, np.inf, blocks).argmin(axis=1)
    highest = np.where(unknown, -np.inf, blocks).argmax(axis=1)
    extremes = np.sort(np.stack([lowest, highest], axis=1), axis=1)
    keep = (extremes + step * np.arange(len(blocks))[:, None]).ravel().clip(max=y.size - 1)
    return x[keep], y[keep]

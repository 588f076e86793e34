"""How the report's pictures look."""

from __future__ import annotations

import base64
import contextlib
import io
from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cdpr_rt.arrays import FloatArray

COLOURS = {"none": "#8a8f98", "thesis": "#2f6fb0", "better": "#d1581a", "floor": "#3b8f5a"}
LABELS = {
    "none": "no compensation",
    "thesis": "thesis' method",
    "better": "harmonic model",
    "floor": "floor: encoder and torque steps",
}
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
    """Return a figure of the report's width and its axes, row by row; `height` in inch a row."""
    figure = Figure(figsize=(7.4, height * rows), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False, sharex=sharex, sharey=sharey)
    return figure, [ax for row in axes for ax in row]


def save_figure(figure: Figure, path: Path, tight: bool = False) -> None:
    """Write a PNG as a whole or not at all, as on a disk that is full; raises OSError.

    `tight`: as large as what is drawn, whatever the layout left outside.
    """
    drawn, part = io.BytesIO(), path.with_name(f"{path.name}.part")
    figure.savefig(drawn, format="png", bbox_inches="tight" if tight else None)
    try:
        part.write_bytes(drawn.getvalue())
        part.replace(path)
    except OSError:
        with contextlib.suppress(OSError):  # the first error tells what is wrong
            part.unlink(missing_ok=True)
        raise


def legend_above(figure: Figure, *axes: Axes, columns: int = 4) -> None:
    """Name what is labelled in `axes` above the figure, row by row, where it hides nothing."""
    named = [pair for ax in axes for pair in zip(*ax.get_legend_handles_labels(), strict=True)]
    by_columns = [pair for column in range(columns) for pair in named[column::columns]]
    handles, labels = zip(*by_columns, strict=True)
    figure.legend(handles, labels, loc="outside upper left", ncols=columns)


def legend_beside_title(
    ax: Axes, columns: int = 3, handles: Sequence[Artist] | None = None
) -> None:
    """Name what is labelled in `ax` at the right in its title's line, where it hides nothing.

    Or only some `handles`. A title, to be set before, that leaves too little room goes above it.
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
    figure.draw_without_rendering()  # only then it is known how much room there is
    named = legend.get_window_extent()
    if title.get_window_extent().overlaps(named):
        ax.set_title(words, pad=mpl.rcParams["axes.titlepad"] + 72.0 * named.height / figure.dpi)


def data_uri(figure: Figure) -> str:
    """Return the figure as the text of an image source that needs no file beside the page."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png")
    figure.clear()
    return "data:image/png;base64," + base64.b64encode(buffer.getvalue()).decode()


def decimated(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return a curve (k,) with few enough points to draw, both extremes of each stretch kept.

    A gap (nan) is kept where it fills a stretch.
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

"""How the report's pictures look."""

from __future__ import annotations

import base64
import io

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

COLOURS = {"none": "#8a8f98", "thesis": "#2f6fb0", "better": "#d1681f", "floor": "#3b8f5a"}
LABELS = {
    "none": "no compensation",
    "thesis": "thesis' method",
    "better": "harmonic model",
    "floor": "floor: encoder and torque step",
}
FORWARD, BACKWARD = "#7a3fa0", "#1f8a8a"

mpl.rcParams.update(
    {
        "figure.dpi": 110,
        "font.size": 9,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.grid": True,
        "grid.alpha": 0.25,
        "legend.frameon": False,
        "lines.linewidth": 1.1,
    }
)


def canvas(rows: int = 1, columns: int = 1, height: float = 3.2) -> tuple[Figure, list[Axes]]:
    """Return a figure of the report's width and its axes, row by row."""
    figure = Figure(figsize=(9.0, height * rows), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False)
    return figure, [ax for row in axes for ax in row]


def embedded(figure: Figure) -> str:
    """Return the figure as the text of an image source that needs no file beside the page."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png")
    return "data:image/png;base64," + base64.b64encode(buffer.getvalue()).decode()

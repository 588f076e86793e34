"""A recording as one picture: motion, torques, tensions and the timing of the cycles."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from cdpr_rt.exchange import FloatArray
from cdpr_rt.runtime.states import LoopState
from cdpr_rt.service.recording_reader import Columns
from tools.errors import BadInputError, WorkFailedError
from tools.recordings.selection import ELAPSED, Selection
from tools.report.style import canvas, legend_above, thinned

FIELDS = (
    "setpoint_rad", "position_rad", "velocity_rad_s", "torque_sent_Nm", "tension_N",
    "lateness_s", "exchange_s", "compute_s", "state",
)  # fmt: skip
_COLOURS = (
    "#2f6fb0", "#d1581a", "#3b8f5a", "#7a3fa0", "#1f8a8a", "#b03a5b", "#8a6d1f", "#8a8f98",
)  # fmt: skip
_TIMES = {"answers in": "exchange_s", "computing": "compute_s", "late by": "lateness_s"}
_SHADES = {LoopState.FAULT: ("#e8b4a8", "fault"), None: ("#e3e5e8", "without power")}


def axes_of(names: Sequence[str], wanted: Sequence[str] | None) -> list[int]:
    """Return the numbers of the axes in `wanted`, all without. Raises BadInputError."""
    for name in wanted or ():
        if name not in names:
            raise BadInputError(f"--axis {name}: allowed: {', '.join(names)}")
    return [names.index(name) for name in wanted or names]


def draw(selection: Selection, axes: Sequence[str] | None, path: Path) -> int:
    """Draw the rows into a PNG file; return their number.

    Raises BadInputError for what there is not, WorkFailedError where it cannot be written.
    """
    columns = selection.columns()
    count = columns["position_rad"].shape[1]
    names = selection.readers[-1].axes[:count]
    names += [str(k) for k in range(len(names), count)]
    chosen = axes_of(names, axes)
    degrees = {name: np.degrees(columns[name]) for name in FIELDS[:3]}
    panels = [
        ("motor angle (deg)", degrees["position_rad"]),
        ("set-point − angle (deg)", degrees["setpoint_rad"] - degrees["position_rad"]),
        ("speed (deg/s)", degrees["velocity_rad_s"]),
        ("torque sent (Nm)", columns["torque_sent_Nm"]),
        ("tension (N)", columns["tension_N"]),
    ]
    panels = [one for one in panels if np.isfinite(one[1][:, chosen]).any()]
    dot = "." if columns[ELAPSED].size == 1 else None
    figure, all_axes = canvas(rows=len(panels) + 1, height=1.75, sharex=True)
    for ax, (label, values) in zip(all_axes, panels, strict=False):
        for k in chosen:
            colour, line = _COLOURS[k % len(_COLOURS)], "-" if k < len(_COLOURS) else "--"
            x, y = thinned(columns[ELAPSED], values[:, k])
            ax.plot(x, y, color=colour, ls=line, marker=dot, label=_as_it_is(names[k]))
        ax.set_ylabel(label)
    _draw_times(all_axes[-1], columns)
    for ax in all_axes:
        _shade(ax, columns)
    all_axes[-1].set_xlabel("bus time since the first cycle (s)")
    if dot is None:
        all_axes[-1].set_xlim(columns[ELAPSED][0], columns[ELAPSED][-1])
    if panels:
        legend_above(figure, all_axes[0])
    figure.align_ylabels()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, format="png")
    except OSError as error:
        raise WorkFailedError(f"{path}: cannot be written: {error.strerror or error}") from error
    return int(columns["state"].size)


def _as_it_is(name: str) -> str:
    """Return a label that shows `name`, whatever it begins with or has in it."""
    return f" {name}".replace("$", r"\$")


def _draw_times(ax: Axes, columns: Columns) -> None:
    for (label, name), colour in zip(_TIMES.items(), _COLOURS, strict=False):
        ax.plot(*thinned(columns[ELAPSED], 1e3 * columns[name]), color=colour, label=label, lw=0.8)
    ax.set_ylabel("of a cycle (ms)")
    ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.0, ncols=3)


def _shade(ax: Axes, columns: Columns) -> None:
    """Colour what was not active; the first stretch of each kind carries its name."""
    elapsed: FloatArray = columns[ELAPSED]
    state = columns["state"]
    edges = [0, *(np.flatnonzero(np.diff(state)) + 1), state.size]
    named = set()
    for a, b in pairwise(edges):
        if state[a] == LoopState.ACTIVE:
            continue
        kind = LoopState.FAULT if state[a] == LoopState.FAULT else None
        colour, label = _SHADES[kind]
        last = elapsed[min(b, state.size - 1)]
        shown = label if kind not in named else None
        named.add(kind)
        ax.axvspan(elapsed[a], last, color=colour, alpha=0.6, lw=0, label=shown, zorder=0)

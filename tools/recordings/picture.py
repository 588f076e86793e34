"""A recording as one picture: motion, torques, tensions and the timing of the cycles."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from scipy.spatial.transform import Rotation

from cdpr_rt.core.exchange import FloatArray
from cdpr_rt.core.states import LoopState
from cdpr_rt.service.recordings.recording_reader import Columns
from cdpr_tools.errors import BadInputError, WorkFailedError
from cdpr_tools.recordings.selection import ELAPSED, Selection
from cdpr_tools.report.style import canvas, decimated, legend_above

FIELDS = (
    "setpoint_rad", "position_rad", "velocity_rad_s", "torque_sent_Nm", "tension_N",
    "lateness_s", "exchange_s", "compute_s", "state", "pose", "pose_setpoint",
)  # fmt: skip
_COLOURS = (
    "#2f6fb0", "#d1581a", "#3b8f5a", "#7a3fa0", "#1f8a8a", "#b03a5b", "#8a6d1f", "#8a8f98",
)  # fmt: skip
_MOVED = 1e-6
"""A coordinate that differs by less over a recording is none of its robot's, m or rad."""
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
    poses = pose_curves(columns)
    dot = "." if columns[ELAPSED].size == 1 else None
    figure, all_axes = canvas(rows=len(panels) + len(poses) + 1, height=1.75, sharex=True)
    for ax, (label, values) in zip(all_axes, panels, strict=False):
        for k in chosen:
            colour, line = _COLOURS[k % len(_COLOURS)], "-" if k < len(_COLOURS) else "--"
            x, y = decimated(columns[ELAPSED], values[:, k])
            ax.plot(x, y, color=colour, ls=line, marker=dot, label=_as_it_is(names[k]))
        ax.set_ylabel(label)
    for ax, (label, curves) in zip(all_axes[len(panels) :], poses.items(), strict=False):
        ax.set_ylabel(label)
        _draw_pose(ax, columns[ELAPSED], curves, dot)
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


Curves = dict[str, tuple[FloatArray, FloatArray]]
"""By the name of a coordinate where the platform is and where it should be, (c,) each."""


def _draw_pose(ax: Axes, elapsed: FloatArray, curves: Curves, dot: str | None) -> None:
    for (name, (is_there, wanted)), colour in zip(curves.items(), _COLOURS, strict=False):
        ax.plot(*decimated(elapsed, is_there), color=colour, marker=dot, label=name)
        ax.plot(*decimated(elapsed, wanted), color=colour, ls="--", lw=0.8)
    ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.0, ncols=3)


def pose_curves(columns: Columns) -> dict[str, Curves]:
    """Return by panel the platform's coordinates that move, each with its set-point, (c,).

    Rotation vectors are from the room's axes.
    """
    poses = columns["pose"], columns["pose_setpoint"]
    position = dict(zip("xyz", zip(*(pose[:, :3].T for pose in poses), strict=True), strict=True))
    turned = zip(*(_rotation_vectors(pose[:, 3:]).T for pose in poses), strict=True)
    rotation = dict(zip(("rx", "ry", "rz"), turned, strict=True))
    panels = {
        "platform (m)": _moved(position),
        "turned (deg)": {
            name: (np.degrees(is_there), np.degrees(wanted))
            for name, (is_there, wanted) in _moved(rotation).items()
        },
    }
    return {label: curves for label, curves in panels.items() if curves}


def _moved(curves: Curves) -> Curves:
    found = {}
    for name, pair in curves.items():
        known = pair[0][np.isfinite(pair[0])]
        if known.size and np.ptp(known) > _MOVED:
            found[name] = pair
    return found


def _rotation_vectors(quaternion: FloatArray) -> FloatArray:
    """Return the rotation vectors (c, 3) of quaternions w x y z, nan where they are not known."""
    vectors = np.full((len(quaternion), 3), np.nan)
    known = np.isfinite(quaternion).all(axis=1)
    if known.any():
        turned = Rotation.from_quat(quaternion[known][:, [1, 2, 3, 0]])
        vectors[known] = turned.as_rotvec()
    return vectors


def _as_it_is(name: str) -> str:
    """Return a label that shows `name`, whatever it begins with or has in it."""
    return f" {name}".replace("$", r"\$")


def _draw_times(ax: Axes, columns: Columns) -> None:
    for (label, name), colour in zip(_TIMES.items(), _COLOURS, strict=False):
        ax.plot(
            *decimated(columns[ELAPSED], 1e3 * columns[name]), color=colour, label=label, lw=0.8
        )
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

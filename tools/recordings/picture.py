"""Draw a recording as one picture: motion, torques, tensions and cycle times."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from textwrap import fill
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.spatial.transform import Rotation

from cdpr_rt.arrays import FloatArray, IntArray
from cdpr_rt.core.states import LoopState, Reaction
from cdpr_rt.service.recording_reader import Columns, RecordingReader
from cdpr_tools.errors import BadInputError
from cdpr_tools.recordings.selection import ELAPSED, Selection
from cdpr_tools.recordings.summary import WHILE_ACTIVE, Reasons, is_fault, why_while_active
from cdpr_tools.style import (
    SERIES,
    decimated,
    legend_above,
    legend_beside_title,
    save_figure,
)

FIELDS = (
    "setpoint_rad", "position_rad", "velocity_rad_s", "torque_sent_Nm", "torque_actual_Nm",
    "tension_N", "cable_length_m", "lateness_s", "exchange_s", "compute_s", "state", "pose",
    "pose_setpoint", "program", "reaction", "stamp_ns",
)  # fmt: skip
_TENSION = "tension (N)"
_STRIP_in, _PANEL_in, _NARROW_in, _WIDE_in = 0.25, 1.7, 7.4, 12.0
_PATH_ROWS: Final = 2
_LETTERS_PER_in: Final = 13
"""Letters per inch in a line of text below the picture."""
_MOST_FAULTS, _PATH_POINTS = 8, 3000
_LETTER = 0.015
"""Width of a letter as a share of the picture's width."""
_SEEN_ns: Final = 200_000_000
"""Longest delay from a reaction to its reason, which recordings take from the loop's status."""
_MOVED = 1e-6
"""If a coordinate varies by less (m or rad) over a recording, the robot does not move it."""
_TIMES = {"answers in": "exchange_s", "computing": "compute_s", "late by": "lateness_s"}
_IN_PLACE: Final = (
    ("position_rad", "cable length (m)", "cable_length_m"),
    ("torque_sent_Nm", "torque (Nm)", "torque_actual_Nm"),
)
"""Field that is unknown, and label and name of the field to draw in its place."""
_POWERLESS, _REACTING, _FAULT = range(1, 4)
_GAP_S, _NOT_RECORDED = 0.5, "not recorded"
"""Rows further apart in time than this are not joined by a line."""
_BEYOND, _ENDED = 0.02, "no longer recorded"
"""Extra share of time drawn after a recording that ends while active, and its label."""
_SHADES = {
    _POWERLESS: ("#e3e5e8", "without power"),
    _REACTING: ("#f6dfae", "reaction to a fault"),
    _FAULT: ("#e8b4a8", "fault"),
}


def axes_of(names: Sequence[str], asked: Sequence[str] | None) -> list[int]:
    """Return the numbers of the axes in `asked`, of all axes if None. Raises BadInputError."""
    for name in asked or ():
        if name not in names:
            raise BadInputError(f"--axis {name}: allowed: {', '.join(names)}")
    return [names.index(name) for name in asked or names]


def draw(selection: Selection, columns: Columns, axes: Sequence[str] | None, path: Path) -> int:
    """Draw the columns of a selection into a PNG file; return the number of their rows.

    Raises BadInputError for unknown axes, WorkFailedError if the file cannot be written.
    """
    count = columns["position_rad"].shape[1]
    names = selection.readers[-1].axes[:count]
    names += [str(k) for k in range(len(names), count)]
    chosen = axes_of(names, axes)
    description = selection.readers[-1].description
    degrees = {name: np.degrees(columns[name]) for name in FIELDS[:3]}
    panels = [
        ("motor angle (deg)", degrees["position_rad"]),
        ("set-point − angle (deg)", degrees["setpoint_rad"] - degrees["position_rad"]),
        ("speed (deg/s)", degrees["velocity_rad_s"]),
        ("torque sent (Nm)", columns["torque_sent_Nm"]),
        (_TENSION, columns["tension_N"]),
    ]
    panels = [one for one in panels if np.isfinite(one[1][:, chosen]).any()]
    for first, label, name in _IN_PLACE:  # recordings of other programs
        if not np.isfinite(columns[first]).any() and np.isfinite(columns[name][:, chosen]).any():
            panels.append((label, columns[name]))
    poses = pose_curves(columns)
    dot = "." if columns[ELAPSED].size == 1 else None
    beside = bool(poses and panels)
    timed = int(any(np.isfinite(columns[name]).any() for name in _TIMES.values()))
    below = len(poses) + timed
    grid = _Grid.of(len(panels), below) if beside else _Grid.of(max(len(panels) + below, 1), 0)
    for ax, (label, values) in zip(grid.timed, panels, strict=False):
        for k in chosen:
            colour, line = SERIES[k % len(SERIES)], "-" if k < len(SERIES) else "--"
            style: dict[str, Any] = {"color": colour, "ls": line, "marker": dot}
            _plot(ax, columns[ELAPSED], values[:, k], label=_as_it_is(names[k]), **style)
        ax.set_ylabel(label.replace(" (", "\n("))
        if label == _TENSION:
            _draw_limits(ax, description, chosen)
    for ax, (label, curves) in zip(grid.timed[len(panels) :], poses.items(), strict=False):
        ax.set_ylabel(label.replace(" (", "\n("))
        _draw_pose(ax, columns[ELAPSED], curves, dot)
    if grid.path is not None:
        _draw_path(grid.path, columns)
    if timed:
        _draw_times(grid.timed[-1], columns)
    _draw_what_happened(grid, selection, columns)
    if panels:
        legend_above(grid.figure, grid.timed[0], columns=10 if beside else 4)
    grid.figure.align_ylabels()
    save_figure(grid.figure, path)
    return int(columns["state"].size)


def recorded_stretches(elapsed: FloatArray) -> list[tuple[int, int]]:
    """Return first row and end (exclusive) of each stretch without a gap in time."""
    gaps = np.flatnonzero(np.diff(elapsed) > _GAP_S) + 1
    return list(pairwise([0, *gaps.tolist(), elapsed.size]))


def _plot(ax: Axes, elapsed: FloatArray, values: FloatArray, label: str = "", **style: Any) -> None:
    """Draw a curve (k,) with a limited number of points, interrupted at gaps in the recording."""
    for a, b in recorded_stretches(elapsed):
        ax.plot(*decimated(elapsed[a:b], values[a:b]), label=label, **style)
        label = ""


def _shade_gaps(ax: Axes, elapsed: FloatArray) -> None:
    label = _NOT_RECORDED
    for (_, b), (a, _) in pairwise(recorded_stretches(elapsed)):
        ax.axvspan(elapsed[b - 1], elapsed[a], fc="white", ec="#d5d8dc", hatch="..", label=label)
        label = ""


def _draw_what_happened(grid: _Grid, selection: Selection, columns: Columns) -> None:
    """Name the programs, shade the times without activity, and list when and why faults occurred.

    If the recording ends while the robot is active, mark and list that too.
    """
    for ax in (*grid.strips, *grid.timed):
        _shade(ax, columns)
        _shade_gaps(ax, columns[ELAPSED])
    for strip in grid.strips:
        draw_programs(strip, columns, selection.readers[-1].description.get("programs", []))
    happened, ended = faults_of(selection.readers, columns), end_while_active(selection, columns)
    for after_s, _ in (*happened, *ended):
        for ax in (*grid.strips, *grid.timed):
            ax.axvline(after_s, color="#b3261e", lw=0.9)
    first_s, last_s = columns[ELAPSED][[0, -1]]
    if last_s > first_s:
        beyond_s = last_s + (_BEYOND * (last_s - first_s) if ended else 0.0)
        grid.timed[-1].set_xlim(first_s, beyond_s)
        for ax in (*grid.strips, *grid.timed) if ended else ():
            ax.axvspan(last_s, beyond_s, fc="none", ec="#b3261e", hatch="////", lw=0, label=_ENDED)
    shown = (*happened[:_MOST_FAULTS], *ended)
    faults = [f"{after_s:.3f} s: {text}" for after_s, text in shown]
    if faults:
        letters = int(_LETTERS_PER_in * grid.figure.get_figwidth())
        lines = [fill(text, letters, subsequent_indent="    ") for text in faults]
        text = "\n".join(map(_as_it_is, lines))
        grid.figure.supxlabel(text, x=0.01, ha="left", fontsize="medium")


@dataclass(frozen=True)
class _Grid:
    """Layout of the picture: columns of panels over a common time, each below a strip."""

    figure: Figure
    strips: list[Axes]
    timed: list[Axes]
    """Panels over time: from the top left downward, then the right column."""
    path: Axes | None
    """The platform's path, below the right column."""

    @classmethod
    def of(cls, left: int, right: int) -> _Grid:
        """Return a layout with these numbers of panels in both columns; `right` may be 0."""
        rows = max(left, right + _PATH_ROWS if right else 0)
        width = _WIDE_in if right else _NARROW_in
        figure = Figure(figsize=(width, _STRIP_in + _PANEL_in * rows), layout="constrained")
        heights = [_STRIP_in, *[_PANEL_in] * rows]
        places = figure.add_gridspec(1 + rows, 2 if right else 1, height_ratios=heights)
        strips: list[Axes] = []
        timed: list[Axes] = []
        for column, count in enumerate((left, right)[: 2 if right else 1]):
            first = strips[0] if strips else None
            strips.append(figure.add_subplot(places[0, column], sharex=first))
            below = range(1, 1 + count)
            timed += [figure.add_subplot(places[k, column], sharex=strips[0]) for k in below]
            for ax in (strips[-1], *timed[-count:-1]):
                ax.tick_params(labelbottom=False)
            timed[-1].set_xlabel("bus time since the first cycle (s)")
        path = figure.add_subplot(places[1 + right :, 1]) if right else None
        return cls(figure, strips, timed, path)


def draw_programs(ax: Axes, columns: Columns, names: Sequence[str]) -> None:
    """Name the program that runs at each moment, if there is room for its name."""
    elapsed, program = columns[ELAPSED], columns["program"]
    ax.set_yticks([])
    ax.tick_params(bottom=False)
    ax.grid(visible=False)
    whole_s = elapsed[-1] - elapsed[0]
    edges = [0, *(np.flatnonzero(np.diff(program)) + 1), program.size]
    for a, b in pairwise(edges):
        number, last_s = int(program[a]), elapsed[min(b, program.size - 1)]
        name = names[number] if number < len(names) else str(number)
        ax.axvline(elapsed[a], color="#777777", lw=0.6)
        if last_s - elapsed[a] > _LETTER * len(name) * whole_s:
            middle = 0.5 * (elapsed[a] + last_s)
            ax.text(middle, 0.5, name, ha="center", va="center", fontsize=8, clip_on=True)


def faults_of(readers: Sequence[RecordingReader], columns: Columns) -> list[tuple[float, str]]:
    """Return when a limit made the loop react, and when its state became a fault, with texts.

    The loop's reason is given with the first event that it explains. The reason is recorded some
    time later, when further limits may be exceeded, such as the speed of a winch whose cable broke.
    """
    stamped = [
        (event["log_time_ns"] - reader.offset_ns, event)
        for reader in readers
        for event in reader.events
    ]
    first_ns, last_ns = columns["stamp_ns"][0], columns["stamp_ns"][-1]
    shown = [one for one in stamped if first_ns <= one[0] <= last_ns and is_fault(one[1])]
    reactions = [at_ns for at_ns, event in shown if event["reaction"] > Reaction.CLAMP]
    found, reasons, shown_ns = list[tuple[float, str]](), Reasons(stamped), -1
    for at_ns, event in shown:
        later = [other_ns for other_ns in reactions if other_ns > at_ns + _SEEN_ns]
        seen_ns, reason = reasons.stamped_after(at_ns, min(later, default=math.inf))
        reason, shown_ns = "" if seen_ns == shown_ns else reason, max(seen_ns, shown_ns)
        after_s = float(np.interp(at_ns, columns["stamp_ns"], columns[ELAPSED]))
        # the reason already begins with the axis of the limit
        text = str(event["text"]).removesuffix(f" of {reason.partition(':')[0]}")
        found.append((after_s, text + (f": {reason}" if reason else "")))
    return found


def end_while_active(selection: Selection, columns: Columns) -> list[tuple[float, str]]:
    """Return when and why the recording ended if its robot was active; else an empty list."""
    last_s = float(columns[ELAPSED][-1])
    why = why_while_active(selection.readers[-1], int(columns["state"][-1]))
    if not why or last_s < selection.ends_s:
        return []
    return [(last_s, f"{WHILE_ACTIVE}: {why}")]


def _draw_limits(ax: Axes, description: dict[str, Any], chosen: Sequence[int]) -> None:
    limits, lines = description.get("limits", {}), []
    for key in ("tension_min_N", "tension_max_N"):
        known = [value for value in limits.get(key) or () if value is not None]
        for value in {known[k] for k in chosen if k < len(known)}:
            lines.append(ax.axhline(value, color="#b3261e", lw=0.8, ls=":", label="limits"))
    if lines:
        legend_beside_title(ax, handles=lines[:1])


def _draw_path(ax: Axes, columns: Columns) -> None:
    """Draw the platform's motion from the front, and its set-point dashed."""
    pose, setpoint = columns["pose"], columns["pose_setpoint"]
    upward = 1 if _flat(pose[:, 2]) else 2
    step = max(1, len(pose) // _PATH_POINTS)
    for values, style, label in ((pose, "-", "platform"), (setpoint, "--", "target")):
        if not np.isfinite(values).any():
            continue
        colour, shown = SERIES[style == "--"], label
        for a, b in recorded_stretches(columns[ELAPSED]):
            known = 1e3 * values[a:b:step]
            ax.plot(known[:, 0], known[:, upward], style, color=colour, label=shown)
            shown = ""
    ax.set_xlabel("x (mm)")
    ax.set_ylabel(f"{'xyz'[upward]} (mm)")
    ax.set_aspect("equal", adjustable="datalim")
    legend_beside_title(ax, 2)


def _flat(values: FloatArray) -> bool:
    known = values[np.isfinite(values)]
    return not known.size or bool(np.ptp(known) <= _MOVED)


Curves = dict[str, tuple[FloatArray, FloatArray]]
"""The platform's value and set-point by the name of a coordinate, (c,) each."""


def _draw_pose(ax: Axes, elapsed: FloatArray, curves: Curves, dot: str | None) -> None:
    for (name, (is_there, setpoint)), colour in zip(curves.items(), SERIES, strict=False):
        _plot(ax, elapsed, is_there, color=colour, marker=dot, label=name)
        _plot(ax, elapsed, setpoint, color=colour, ls="--", lw=0.8)
    legend_beside_title(ax, 3)


def pose_curves(columns: Columns) -> dict[str, Curves]:
    """Return the platform's moving coordinates and their set-points, (c,), by panel.

    Rotation vectors are relative to the room's axes.
    """
    poses = columns["pose"], columns["pose_setpoint"]
    position = dict(zip("xyz", zip(*(pose[:, :3].T for pose in poses), strict=True), strict=True))
    turned = zip(*(_rotation_vectors(pose[:, 3:]).T for pose in poses), strict=True)
    # a third coordinate of 0 means a robot in a plane, whose directions are x, y and angle
    names = ("rx", "ry", "rz" if np.nan_to_num(poses[0][:, 2]).any() else "angle")
    rotation = dict(zip(names, turned, strict=True))
    panels = {
        "platform (m)": _moved(position),
        "turned (deg)": {
            name: (np.degrees(is_there), np.degrees(setpoint))
            for name, (is_there, setpoint) in _moved(rotation).items()
        },
    }
    found = {label: curves for label, curves in panels.items() if curves}
    if panels["platform (m)"] and np.isfinite(poses[1]).any():
        off = np.linalg.norm(poses[0][:, :3] - poses[1][:, :3], axis=1)
        found["distance from set-point (mm)"] = {"distance": (1e3 * off, np.full(off.size, np.nan))}
    return found


def _moved(curves: Curves) -> Curves:
    found = {}
    for name, pair in curves.items():
        known = pair[0][np.isfinite(pair[0])]
        if known.size and np.ptp(known) > _MOVED:
            found[name] = pair
    return found


def _rotation_vectors(quaternion: FloatArray) -> FloatArray:
    """Return the rotation vectors (c, 3) of quaternions w x y z, nan if they are not known."""
    vectors = np.full((len(quaternion), 3), np.nan)
    known = np.isfinite(quaternion).all(axis=1)
    if known.any():
        turned = Rotation.from_quat(quaternion[known][:, [1, 2, 3, 0]])
        vectors[known] = turned.as_rotvec()
    return vectors


def _as_it_is(name: str) -> str:
    """Return a label that shows `name` literally, with any first letter or special character."""
    return f" {name}".replace("$", r"\$")


def _draw_times(ax: Axes, columns: Columns) -> None:
    for (label, name), colour in zip(_TIMES.items(), SERIES, strict=False):
        _plot(ax, columns[ELAPSED], 1e3 * columns[name], color=colour, label=label, lw=0.8)
    ax.set_ylabel("of a cycle\n(ms)")
    legend_beside_title(ax, 3)


def shades(state: IntArray, reaction: IntArray) -> IntArray:
    """Return the kind of shade of each row, (c,), 0 for none, from its state and reaction, (c,).

    The supervisor reports a reaction only while the limit is exceeded; a stop lasts until the
    robot is no longer active.
    """
    row, active = np.arange(state.size), state == LoopState.ACTIVE
    kinds = np.where(active, 0, _POWERLESS)
    kinds[reaction > Reaction.CLAMP] = _REACTING
    stop, rest = (
        np.maximum.accumulate(np.where(there, row, -1))
        for there in (active & (reaction > Reaction.HOLD), ~active)
    )
    kinds[active & (stop > rest)] = _REACTING
    kinds[state == LoopState.FAULT] = _FAULT
    return kinds


def _shade(ax: Axes, columns: Columns) -> None:
    """Shade the times without normal activity; label the first stretch of each kind."""
    elapsed: FloatArray = columns[ELAPSED]
    kinds = shades(columns["state"], columns["reaction"])
    edges = [0, *(np.flatnonzero(np.diff(kinds)) + 1), kinds.size]
    named = set()
    for a, b in pairwise(edges):
        kind = int(kinds[a])
        if kind == 0:
            continue
        colour, label = _SHADES[kind]
        last = elapsed[min(b, kinds.size - 1)]
        shown = label if kind not in named else None
        named.add(kind)
        ax.axvspan(elapsed[a], last, color=colour, alpha=0.6, lw=0, label=shown, zorder=0)

"""The trial of lines and turns at constant speed: 10 mm/s is 22 deg/s at the thesis' motors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from cdpr_rt.arrays import FloatArray, rms
from cdpr_tools.trials.directions import Directions
from cdpr_tools.trials.figures import Figure
from cdpr_tools.trials.recorded import Recorded
from cdpr_tools.trials.run import TrialRun

SPEED_m_s: Final = 0.01
LENGTH_m: Final = 0.6
"""Length of each line, but at most half the workspace; motors make several turns along it."""
RATIO: Final = 3.0
"""Smallest ratio of the distances without and with compensation, at `SPEED_m_s`."""
SETPOINT_mm: Final = 2.0
"""Largest distance from the set-point at other speeds."""
WITH, WITHOUT = "with", "without"
NAMES: Final = {WITH: "with compensation", WITHOUT: "without"}


def lines(directions: Directions) -> list[tuple[FloatArray, FloatArray]]:
    """Return the ends (d,) of a line along each direction through the middle of the workspace.

    Along an angle, the line is a turn, from half the allowed angle on one side to half on the
    other.
    """
    middle, size = directions.middle, directions.high_m - directions.low_m
    reach = np.minimum(0.5 * LENGTH_m, 0.25 * size)
    reach = np.append(reach, np.full(len(directions.turns), 0.5 * directions.angle_rad))
    return [(middle - half, middle + half) for half in np.diag(reach) if half.any()]


def drive(run: TrialRun, speed_m_s: float) -> None:
    """Move along each line once, and at full speed to its beginning."""
    directions = run.directions
    for start, end in lines(directions):
        run.go(start)
        run.stay(2.0)
        run.mark("line", **directions.marked(start, "from"), **directions.marked(end, "to"))
        run.go(end, speed_m_s)
        run.mark("line end")


@dataclass(frozen=True)
class LineErrors:
    """Recorded errors along one line, or turn, in mm and degrees, one row per cycle."""

    direction: int
    """Index of the line's direction."""
    is_turn: bool
    way: FloatArray
    """Position along the line, m or rad, (c,)."""
    across_mm: FloatArray
    """True distance from the line at right angles to it, (c, k - 1); (c, 0) for a turn."""
    off_mm: FloatArray
    """True distance from the set-point of the same cycle, (c, k)."""
    off_deg: FloatArray
    """True rotation from that set-point, (c, 3); (c, 0) if angles are not controlled."""


def line_errors(recorded: Recorded) -> list[LineErrors]:
    """Return the errors of all lines."""
    directions, found = recorded.directions, []
    k = directions.k
    for mark, end in zip(recorded.marked("line"), recorded.marked("line end"), strict=True):
        rows = slice(recorded.row(mark["cycle"]), recorded.row(end["cycle"]))
        start, stop = directions.place(mark, "from"), directions.place(mark, "to")
        along = (stop - start) / np.linalg.norm(stop - start)
        direction = int(np.abs(along).argmax())
        off = recorded.true_m[rows] - recorded.setpoint_m[rows]
        true = recorded.true_m[rows] - start[:k]
        found.append(
            LineErrors(
                direction,
                direction >= k,
                (recorded.true_places[rows] - start) @ along,
                1e3 * true @ _at_right_angles(along[:k]),
                1e3 * off,
                np.degrees(recorded.turned_off_rad[rows]),
            )
        )
    return found


def _at_right_angles(along: FloatArray) -> FloatArray:
    """Return unit vectors (k, k - 1) at right angles to a vector; (k, 0) if it is zero."""
    if not along.any():
        return np.zeros((along.size, 0))
    found: list[FloatArray] = [along / np.linalg.norm(along)]
    for i in np.argsort(np.abs(along), kind="stable")[:-1]:
        unit = np.eye(along.size)[i]
        unit = unit - sum((unit @ other) * other for other in found)
        found.append(unit / np.linalg.norm(unit))
    return np.array(found[1:]).T


def rms_mm(recorded: Recorded, less_mean: bool = False) -> tuple[float, float]:
    """Return the RMS distance over all lines, from the line and from the set-point.

    With `less_mean` the mean of each line's errors is subtracted first. The mean shows how well the
    start is known, not how a motor runs.
    """
    straight = [one for one in line_errors(recorded) if not one.is_turn]
    return (
        _rms([one.across_mm for one in straight], less_mean),
        _rms([one.off_mm for one in straight], less_mean),
    )


def _rms(errors: list[FloatArray], less_mean: bool = False) -> float:
    if less_mean:
        errors = [one - one.mean(axis=0) for one in errors]
    return rms(np.concatenate(errors))


def judge(parts: dict[str, Recorded], speed_m_s: float) -> list[Figure]:
    """Return the errors of each part, and the gain by compensation."""
    figures, ratios = [], []
    slow = speed_m_s == SPEED_m_s
    for less_mean in (False, True):
        key, less = ("_less_mean", ", minus its mean") if less_mean else ("", "")
        rms = {part: rms_mm(recorded, less_mean) for part, recorded in parts.items()}
        for i, (what, text) in enumerate((("path", "line"), ("setpoint", "set-point"))):
            judged = what == "setpoint" and not less_mean
            for part, values in rms.items():
                title = f"RMS distance from the {text}{less}, {NAMES[part]}"
                limit = SETPOINT_mm if judged and not slow and part == best(parts) else None
                figures.append(Figure(f"{what}_{part}{key}_mm", title, values[i], "mm", limit))
            if len(rms) == len(NAMES):
                ratio = rms[WITHOUT][i] / rms[WITH][i]
                title = f"distance from the {text}{less}, ratio without to with"
                limit = RATIO if judged and slow else None
                ratios.append(Figure(f"{what}{key}_ratio", title, ratio, "", limit, True))
    return [*figures, *_orientation(parts), *ratios]


def best(parts: dict[str, Recorded]) -> str:
    """Return the part with the strictest limits."""
    return WITH if WITH in parts else WITHOUT


def _orientation(parts: dict[str, Recorded]) -> list[Figure]:
    """Return the orientation errors on lines and in turns, if angles are controlled."""
    figures = []
    for part, recorded in parts.items():
        found, name = line_errors(recorded), NAMES[part]
        if recorded.directions.turns:
            value = _rms([one.off_deg for one in found])
            title = f"RMS angle from the set-point, {name}"
            figures.append(Figure(f"orientation_{part}_deg", title, value, "deg"))
        if turns := [one.off_mm for one in found if one.is_turn]:
            title = f"RMS distance from the set-point in turns, {name}"
            figures.append(Figure(f"turn_{part}_mm", title, _rms(turns), "mm"))
    return figures

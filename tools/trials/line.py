"""The trial of lines at 10 mm/s, which is 22 deg/s at the motors of the thesis' winches."""

from __future__ import annotations

from typing import Final

import numpy as np

from cdpr_rt.exchange import FloatArray
from tools.trials.figures import Figure
from tools.trials.recorded import Recorded
from tools.trials.run import TrialRun

SPEED_m_s: Final = 0.01
LENGTH_m: Final = 0.6
"""Of each line, or half of what the workspace offers there; motors turn several times in it."""
RATIO: Final = 3.0
WITH, WITHOUT = "with", "without"


def lines(run: TrialRun) -> list[tuple[FloatArray, FloatArray]]:
    """Return the ends of a level line and an upright one through the middle of the workspace."""
    middle, size = 0.5 * (run.low_m + run.high_m), run.high_m - run.low_m
    found = []
    for axis in range(2):
        half = np.zeros(2)
        half[axis] = 0.5 * min(LENGTH_m, 0.5 * float(size[axis]))
        found.append((middle - half, middle + half))
    return found


def drive(run: TrialRun, _seconds: float) -> None:
    """Move along each line once, there at full speed."""
    for start, end in lines(run):
        run.go(start)
        run.stay(2.0)
        run.mark("line", from_m=start.tolist(), to_m=end.tolist())
        run.go(end, speed_m_s=SPEED_m_s)
        run.mark("line end")


def path_errors(recorded: Recorded) -> list[tuple[FloatArray, FloatArray, FloatArray]]:
    """Return of each line: the way along it in m (k,), and two errors in mm, (k,) and (k, 2).

    The first error is the true distance from the line, with its sign; the second that from the
    set-point of the same cycle, in x and y.
    """
    found = []
    for mark, end in zip(recorded.marked("line"), recorded.marked("line end"), strict=True):
        rows = slice(recorded.row(mark["cycle"]), recorded.row(end["cycle"]))
        start, stop = np.array(mark["from_m"]), np.array(mark["to_m"])
        along = (stop - start) / np.linalg.norm(stop - start)
        across = np.array([-along[1], along[0]])
        true = recorded.true_m[rows]
        off = true - recorded.setpoint_m[rows]
        found.append(((true - start) @ along, 1e3 * (true - start) @ across, 1e3 * off))
    return found


def rms_mm(recorded: Recorded, less_mean: bool = False) -> tuple[float, float]:
    """Return the root mean square over all lines: of the distance from them, from the set-point.

    With `less_mean` that of what is left of each line's errors without their mean, which does not
    tell how a motor runs but how well the start is known.
    """
    found = path_errors(recorded)
    errors = [(one[1][:, None], one[2]) for one in found]
    if less_mean:
        errors = [(a - a.mean(axis=0), b - b.mean(axis=0)) for a, b in errors]
    across, off = (np.concatenate([one[k] for one in errors]) for k in range(2))
    return _rms(across), _rms(off)


def _rms(errors: FloatArray) -> float:
    return float(np.sqrt(np.mean(np.sum(errors**2, axis=1))))


def judge(parts: dict[str, Recorded]) -> list[Figure]:
    """Return the errors of each part, and what compensation has made of them."""
    names = {WITH: "with compensation", WITHOUT: "without"}
    figures, ratios = [], []
    for less_mean in (False, True):
        key, less = ("_less_mean", ", less its mean") if less_mean else ("", "")
        rms = {part: rms_mm(recorded, less_mean) for part, recorded in parts.items()}
        for i, (what, text) in enumerate((("path", "line"), ("setpoint", "set-point"))):
            for part, values in rms.items():
                told = f"RMS distance from the {text}{less}, {names[part]}"
                figures.append(Figure(f"{what}_{part}{key}_mm", told, values[i], "mm"))
            if len(rms) == len(names):
                ratio = rms[WITHOUT][i] / rms[WITH][i]
                told = f"distance from the {text}{less}, without over with"
                limit = RATIO if what == "setpoint" and not less_mean else None
                ratios.append(Figure(f"{what}{key}_ratio", told, ratio, "", limit, True))
    return [*figures, *ratios]

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
    """Return of each line: the way along it in m, and two errors in mm, (k,) each.

    The first error is the true distance from the line, with its sign; the second that from the
    set-point of the same cycle.
    """
    found = []
    for mark, end in zip(recorded.marked("line"), recorded.marked("line end"), strict=True):
        rows = slice(recorded.row(mark["cycle"]), recorded.row(end["cycle"]))
        start, stop = np.array(mark["from_m"]), np.array(mark["to_m"])
        along = (stop - start) / np.linalg.norm(stop - start)
        across = np.array([-along[1], along[0]])
        true = recorded.true_m[rows]
        off = np.linalg.norm(true - recorded.setpoint_m[rows], axis=1)
        found.append(((true - start) @ along, 1e3 * (true - start) @ across, 1e3 * off))
    return found


def rms_mm(recorded: Recorded) -> tuple[float, float]:
    """Return the root mean square over all lines: of the distance from them, from the set-point."""
    found = path_errors(recorded)
    across = np.concatenate([one[1] for one in found])
    off = np.concatenate([one[2] for one in found])
    return float(np.sqrt(np.mean(across**2))), float(np.sqrt(np.mean(off**2)))


def judge(parts: dict[str, Recorded]) -> list[Figure]:
    """Return the errors of each part, and what compensation has made of them."""
    names = {WITH: "with compensation", WITHOUT: "without"}
    rms = {part: rms_mm(recorded) for part, recorded in parts.items()}
    figures = []
    for part, (across, off) in rms.items():
        figures += [
            Figure(f"path_{part}_mm", f"RMS distance from the line, {names[part]}", across, "mm"),
            Figure(
                f"setpoint_{part}_mm", f"RMS distance from the set-point, {names[part]}", off, "mm"
            ),
        ]
    for part, recorded in parts.items():
        text = f"of it, about its mean on each line, {names[part]}"
        figures.append(Figure(f"ripple_{part}_mm", text, _ripple_mm(recorded), "mm"))
    if len(rms) == len(names):
        texts = ("path_ratio", "line"), ("setpoint_ratio", "set-point")
        for i, (key, what) in enumerate(texts):
            ratio = rms[WITHOUT][i] / rms[WITH][i]
            text = f"distance from the {what}, without over with"
            figures.append(Figure(key, text, ratio, "", RATIO, at_least=True))
    return figures


def _ripple_mm(recorded: Recorded) -> float:
    """Return the root mean square of the distance from the lines less its mean on each."""
    rest = [across - across.mean() for _, across, _ in path_errors(recorded)]
    return float(np.sqrt(np.mean(np.concatenate(rest) ** 2)))

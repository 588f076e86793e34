"""The trial of a robot whose geometry was measured with a tape (Tremblay, section 3.6).

A robot must reach the poses of its calibration before it is calibrated. Until then, errors of
its geometry may only reduce accuracy: no cable may break or hang slack.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Final

import numpy as np

from cdpr_profiles import Robot
from cdpr_profiles.bounded_input import read_toml
from cdpr_rt.arrays import rms
from cdpr_tools.trials.directions import platform_of
from cdpr_tools.trials.figures import Figure
from cdpr_tools.trials.limits import held_figures
from cdpr_tools.trials.recorded import Recorded
from cdpr_tools.trials.run import TrialRun

OFF_M: Final = (0.02, 0.05)
"""Smallest and largest distance of each true exit point from that of the robot's file."""
POSES: Final = 100
SPEED_SHARE: Final = 0.25
"""Share of the speed in the robot's file: a robot that is not calibrated yet moves slowly."""
STAY_S: Final = 1.0
_TIME_OVER: Final = "time over"
"""The mark of a trial whose time ended before all poses were reached."""


def plant_text(robot: Robot, plant: Path | None, seed: int) -> str:
    """Return the plant file of the trial: the given one with randomly moved exit points.

    A file that already has a table [geometry] is used unchanged. Raises ProfileError.
    """
    known = {} if plant is None else read_toml(plant)
    text = "" if plant is None else plant.read_text(encoding="utf-8")
    if "geometry" in known:
        return text
    platform, chance = platform_of(robot), np.random.default_rng(seed)
    directions = chance.standard_normal(np.shape(platform.exit_points_m))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    errors = chance.uniform(*OFF_M, (len(directions), 1)) * directions
    return f"{text}\n[geometry]\nexit_errors_m = {json.dumps(errors.round(4).tolist())}\n"


def drive(run: TrialRun, seconds: float) -> None:
    """Move slowly to random poses and back to the middle."""
    speed_m_s = SPEED_SHARE * float(run.directions.speed[0])
    for _ in range(POSES):
        if run.elapsed_s >= seconds:
            run.mark(_TIME_OVER)
            break
        target = run.directions.marked(run.start_random_move(speed_m_s), "target")
        run.arrive()
        run.stay(STAY_S)
        run.mark("pose", **target)
        run.go(run.directions.middle, speed_m_s)
        run.stay(STAY_S)


def judge(recorded: Recorded, robot: Robot) -> list[Figure]:
    """Return the extremes of tension and torque, and the errors at the poses.

    If the time ended first, one pose is enough: missing poses are not the robot's fault.
    """
    directions, marks = recorded.directions, recorded.marked("pose")
    rows = [recorded.row(mark["cycle"]) for mark in marks]
    targets = np.array([directions.place(mark, "target") for mark in marks])
    targets = targets.reshape(-1, directions.d)
    off = np.linalg.norm(recorded.true_m[rows] - targets[:, : directions.k], axis=1)
    cut_short = bool(recorded.marked(_TIME_OVER))
    text = f"poses, out and back{f', of {POSES}: the time ran out' if cut_short else ''}"
    figures = [
        Figure("poses", text, len(marks), "", 1 if cut_short else POSES, True),
        Figure("minutes", "bus time", float(recorded.time_s[-1]) / 60.0, "min"),
        *held_figures(recorded, robot),
        Figure("off_rms_mm", "RMS distance from a pose", 1e3 * rms(off) if len(off) else 0.0, "mm"),
        Figure("off_mm", "worst distance from a pose", 1e3 * float(off.max(initial=0)), "mm"),
    ]
    if directions.turns:
        true = recorded.truth["rotation"][rows]
        turned = directions.turn_between(directions.rotations(targets), true)
        angle = float(np.degrees(np.linalg.norm(turned, axis=1).max(initial=0.0)))
        figures.append(Figure("orientation_off_deg", "worst angle from a pose", angle, "deg"))
    return figures

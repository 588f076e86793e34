"""What was reached at each target: from recordings and true poses, or of a perfect robot."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from cdpr_profiles.platform import Platform
from cdpr_rt.arrays import FloatArray
from cdpr_rt.motion.stream_buttons import confirmation
from cdpr_tools.errors import WorkFailedError
from cdpr_tools.experiment.model.parameters import OperatorParameters, Station
from cdpr_tools.experiment.model.plants import PerfectRobot
from cdpr_tools.experiment.path import plane_of, targets_m
from cdpr_tools.experiment.session import MARK
from cdpr_tools.experiment.trial import Condition, run_trial
from cdpr_tools.trials.evaluation.recorded import Recorded

Points = NDArray[np.void]
POINT: Final = np.dtype(
    [
        ("place", "U1"), ("scale", "f8"), ("round_trip_s", "f8"), ("repeat", "i4"),
        ("target", "i4"), ("error_m", "f8", (2,)), ("judged_m", "f8", (2,)),
        ("hand_m", "f8", (2,)), ("robot_m", "f8", (2,)), ("following_m", "f8", (2,)),
        ("begun_s", "f8"), ("pressed_s", "f8"), ("tries", "i4"),
    ]
)  # fmt: skip
"""A confirmed target. `error_m` is the true position less the target when the confirmation was
recorded; it is the sum of three parts: `judged_m`, the true error in the pictures that the
operator was content with; `hand_m`, what the set-point, which the hand leads, moved from then on;
`robot_m`, what the platform moved beyond that. `following_m` is the true position less the
set-point, which the operator sees and corrects."""


def points_of_session(folder: Path) -> Points:
    """Return the targets confirmed in a session, (k,) of POINT, from its recording alone.

    Raises BadInputError and WorkFailedError for files that are missing or unfinished.
    """
    recorded = Recorded(folder)
    parts = [_points_of_path(recorded, path) for path in recorded.marked(MARK)]
    return np.concatenate(parts) if parts else np.zeros(0, POINT)


def _points_of_path(recorded: Recorded, path: dict[str, Any]) -> Points:
    targets, condition = np.array(path["targets_m"]), path["condition"]
    rows = slice(recorded.row(path["first_cycle"]), recorded.row(path["cycle"]) + 1)
    numbers = confirmation(recorded.cycles["stream_buttons"][rows].astype(np.int64))
    found = rows.start + 1 + np.flatnonzero(np.diff(numbers) > 0)
    if len(found) != len(path["points"]):
        raise WorkFailedError(
            f"{recorded.folder}: {len(found)} confirmations recorded, {len(path['points'])} given"
        )
    points = np.zeros(len(found), POINT)
    plane = list(plane_of(recorded.directions.k))
    true_m, setpoint_m = recorded.true_m[:, plane], recorded.setpoint_m[:, plane]
    for point, row, entry in zip(points, found, path["points"], strict=True):
        look = slice(*(recorded.row(cycle) + end for end, cycle in enumerate(entry["look_cycles"])))
        _fill(point, condition, entry)
        target = targets[entry["target"]]
        point["error_m"] = true_m[row] - target
        point["judged_m"] = true_m[look].mean(axis=0) - target
        point["hand_m"] = setpoint_m[row] - setpoint_m[look].mean(axis=0)
        point["robot_m"] = point["error_m"] - point["judged_m"] - point["hand_m"]
        point["following_m"] = true_m[row] - setpoint_m[row]
    return points


def points_of_perfect_robot(
    platform: Platform,
    centre_m: FloatArray,
    condition: Condition,
    operator: OperatorParameters,
    station: Station,
    seed: int,
) -> Points:
    """Return the points of the same operator, hand and vision with a robot without error."""
    robot = PerfectRobot(platform, centre_m)
    targets = targets_m(centre_m)
    trial = run_trial(robot, condition, targets, operator, station, seed)
    true_m = np.array(robot.track_m)
    points = np.zeros(len(trial.points), POINT)
    for point, entry in zip(points, trial.points, strict=True):
        _fill(point, asdict(condition), entry)
        target = targets[entry["target"]]
        look = slice(entry["look_cycles"][0], entry["look_cycles"][1] + 1)
        point["error_m"] = true_m[entry["cycle"]] - target
        point["judged_m"] = true_m[look].mean(axis=0) - target
        point["hand_m"] = point["error_m"] - point["judged_m"]
    return points


def _fill(point: Any, condition: dict[str, Any], entry: dict[str, Any]) -> None:
    for name in ("place", "scale", "round_trip_s", "repeat"):
        point[name] = condition[name]
    for name in ("target", "begun_s", "pressed_s", "tries"):
        point[name] = entry[name]

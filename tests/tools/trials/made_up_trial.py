"""Recordings of trials that never were, whose figures are known."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tools.trials.recorded import Recorded

PERIOD_S = 1e-3
FIRST = 500


def recorded(
    true_m: np.ndarray,
    setpoint_m: np.ndarray,
    marks: Sequence[dict[str, Any]],
    **truth: np.ndarray,
) -> Recorded:
    """Return cycles in which the platform was at `true_m` (k, 2); marks count rows from 0."""
    count = len(true_m)
    made = object.__new__(Recorded)
    made.folder, made.first = Path("made-up"), FIRST
    made.cycles = {
        "cycle": FIRST + np.arange(count),
        "time_s": (FIRST + np.arange(count)) * PERIOD_S,
        "pose_setpoint": np.pad(setpoint_m, ((0, 0), (0, 5))),
        "torque_sent_Nm": np.zeros((count, 3)),
    }
    given = {"tension_N": np.full((count, 3), 50.0), "torque_Nm": np.ones((count, 3)), **truth}
    fields = [("position_m", "f8", (3,)), ("velocity_m_s", "f8", (3,))]
    fields += [(name, "f8", (3,)) for name in given]
    made.truth = np.zeros(count, fields)
    made.truth["position_m"][:, :2] = true_m
    for name, values in given.items():
        made.truth[name] = values
    made.marks = [{**mark, "cycle": FIRST + mark.get("row", 0)} for mark in marks]
    return made

"""The trial at the limits: random targets at full speed and acceleration, some changed half-way."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from cdpr_rt.exchange import FloatArray
from cdpr_rt.runtime.robot_arrays import limits_of
from profiles import Robot
from tools.trials.figures import Figure
from tools.trials.recorded import Recorded
from tools.trials.run import TrialRun, platform_of

OVERSHOOT_mm: Final = 2.0
_FINISHED_SHARE: Final = 0.7
_REST_S: Final = (0.0, 1.0)
_CHANGED_AFTER_S: Final = (0.05, 1.2)
_TORQUE_STEP_SHARE: Final = 1e-3
"""Torque crosses the bus in per mille of the rated one."""


def drive(run: TrialRun, seconds: float) -> None:
    """Head for one target after the other; nearly a third are given up on the way."""
    chance = run.chance
    while run.elapsed_s < seconds:
        target = run.head_anywhere()
        run.mark("leg", target_m=target.tolist())
        if chance.random() < _FINISHED_SHARE:
            run.arrive()
            run.stay(chance.uniform(*_REST_S))
        else:
            run.stay(chance.uniform(*_CHANGED_AFTER_S))


@dataclass(frozen=True)
class Leg:
    """The rows of one leg, its target, and the box in which the platform may be meanwhile."""

    rows: slice
    target_m: FloatArray
    low_m: FloatArray
    high_m: FloatArray

    def beyond_m(self, true_m: FloatArray) -> FloatArray:
        """Return how far out of its box the platform (k, 2) was at most, in each direction."""
        true = true_m[self.rows]
        out = np.maximum(self.low_m - true, true - self.high_m)
        return np.asarray(np.maximum(out.max(axis=0), 0.0))


def legs(recorded: Recorded, acceleration_m_s2: float) -> list[Leg]:
    """Return all legs of a trial.

    A leg's box spans, in each direction, from where the platform truly was at its beginning to its
    target; with it the place where the set-point could stop at the earliest, which may lie further
    where the target was changed half-way.
    """
    marks = recorded.marked("leg")
    first = [recorded.row(mark["cycle"]) for mark in marks]
    last = [*first[1:], len(recorded.truth)]
    found = []
    for mark, begin, end in zip(marks, first, last, strict=True):
        target = np.array(mark["target_m"])
        setpoint = recorded.setpoint_m[max(begin - 1, 0) : begin + 1]
        speed = (setpoint[-1] - setpoint[0]) / recorded.period_s
        stop = setpoint[-1] + speed * np.abs(speed) / (2.0 * acceleration_m_s2)
        corners = np.array([recorded.true_m[begin], target, stop])
        found.append(Leg(slice(begin, end), target, corners.min(axis=0), corners.max(axis=0)))
    return found


def judge(recorded: Recorded, robot: Robot) -> list[Figure]:
    """Return the extremes of tension and torque, and the worst overshoot."""
    limits, platform = limits_of(robot), platform_of(robot)
    tension, torque = recorded.truth["tension_N"], recorded.truth["torque_Nm"]
    low, high = np.asarray(limits.tension_min_N), np.asarray(limits.tension_max_N)
    slack, most = np.asarray(limits.slack_N), np.asarray(limits.torque_Nm)
    outside = ((tension < low) | (tension > high)).any(axis=1)
    sent = np.abs(recorded.cycles["torque_sent_Nm"])
    rated = np.array([axis.winch.motor.rated_torque_Nm for axis in robot.axes])
    found = legs(recorded, platform.acceleration_m_s2)
    beyond = np.array([leg.beyond_m(recorded.true_m) for leg in found]).reshape(-1, 2)
    speed = np.abs(recorded.truth["velocity_m_s"][:, :2]).max(axis=0)
    bound = "Nm", float(most.max() + _TORQUE_STEP_SHARE * rated.max())
    return [
        Figure("legs", "legs, each to a random target", len(found)),
        Figure("minutes", "bus time", float(recorded.time_s[-1]) / 60.0, "min"),
        Figure("top_speed_m_s", "fastest in x or y", float(speed.max()), "m/s"),
        Figure("tension_min_N", "least tension", float(tension.min()), "N", low.min(), True),
        Figure("tension_max_N", "greatest tension", float(tension.max()), "N", high.max()),
        Figure("outside_cycles", "cycles with a tension out of its bounds", outside.sum(), "", 0),
        Figure(
            "slack_cycles", "cycles with a slack cable", (tension < slack).any(axis=1).sum(), "", 0
        ),
        Figure("torque_sent_Nm", "greatest torque asked of a motor", float(sent.max()), *bound),
        Figure("torque_true_Nm", "greatest torque of a motor", float(np.abs(torque).max()), "Nm"),
        Figure("overshoot_mm", "overshoot", 1e3 * float(beyond.max()), "mm", OVERSHOOT_mm),
    ]

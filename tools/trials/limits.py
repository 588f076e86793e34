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
SMOOTHED_S: Final = 0.06
"""Over which a controller may average its set-point."""
_FINISHED_SHARE: Final = 0.7
_REST_S: Final = (0.0, 1.0)
_CHANGED_AFTER_S: Final = (0.05, 1.2)
_MOVED_m: Final = 2e-3
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
    """The rows of one leg, where it began, its target, and where it could be stopped, (2,) each."""

    rows: slice
    from_m: FloatArray
    target_m: FloatArray
    stop_m: FloatArray

    def overshoot_m(self, true_m: FloatArray) -> FloatArray:
        """Return how far the platform (k, 2) was beyond its target at most, in each direction.

        A direction in which it had hardly to move has none.
        """
        way = self.target_m - self.from_m
        sign = np.sign(way)
        farthest = np.maximum(sign * self.target_m, sign * self.stop_m)
        beyond = (sign * true_m[self.rows]).max(axis=0) - farthest
        return np.where(np.abs(way) > _MOVED_m, np.maximum(beyond, 0.0), 0.0)

    def off_m(self, true_m: FloatArray) -> float:
        """Return how far it was, in a direction, out of the box that beginning and target span."""
        corners = np.array([self.from_m, self.target_m, self.stop_m])
        true = true_m[self.rows]
        out = np.maximum(corners.min(axis=0) - true, true - corners.max(axis=0))
        return max(0.0, float(out.max()))


def legs(recorded: Recorded, acceleration_m_s2: float) -> list[Leg]:
    """Return all legs of a trial.

    Where a target was changed half-way the set-point still moves: `stop_m` is where it turns, in
    each direction, which may lie beyond the new target; but no farther than where the acceleration
    stops a set-point that smoothing lets run on for a moment.
    """
    marks = recorded.marked("leg")
    first = [recorded.row(mark["cycle"]) for mark in marks]
    last = [*first[1:], len(recorded.truth)]
    found = []
    for mark, begin, end in zip(marks, first, last, strict=True):
        setpoint = recorded.setpoint_m[max(begin - 1, 0) : end]
        now, speed = setpoint[1], (setpoint[1] - setpoint[0]) / recorded.period_s
        runs_on = np.abs(speed) * (SMOOTHED_S + np.abs(speed) / (2.0 * acceleration_m_s2))
        turn = np.where(speed > 0.0, setpoint.max(axis=0), setpoint.min(axis=0))
        stop = now + np.clip(turn - now, -runs_on, runs_on)
        target = np.array(mark["target_m"])
        found.append(Leg(slice(begin, end), recorded.true_m[begin], target, stop))
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
    beyond = np.array([leg.overshoot_m(recorded.true_m) for leg in found]).reshape(-1, 2)
    off = max(leg.off_m(recorded.true_m) for leg in found)
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
        Figure("off_mm", "farthest from the box of a leg, sideways too", 1e3 * off, "mm"),
    ]

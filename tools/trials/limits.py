"""The trial at the limits: random targets at full speed and acceleration, some changed en route."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from cdpr_profiles import Robot
from cdpr_rt.arrays import FloatArray
from cdpr_rt.model.robot_arrays import limits_of
from cdpr_tools.trials.figures import Figure
from cdpr_tools.trials.recorded import Recorded
from cdpr_tools.trials.run import TrialRun

OVERSHOOT_mm: Final = 2.0
SWING_mm: Final = 2.0
"""A platform whose origin stays this close to its target no longer swings."""
SWING_S: Final = 2.0
SMOOTHED_S: Final = 0.06
"""Longest time over which a controller may average its set-point."""
RESTED_S: Final = 0.5
"""After this time at rest, the end of the leg counts as the place where the platform came to rest.
"""
_FINISHED_SHARE: Final = 0.7
_REST_S: Final = (0.0, 1.0)
_LONG_REST_S: Final = 4.0
_LONG_EVERY: Final = 5
"""A long rest follows every n-th finished move."""
_CHANGED_AFTER_S: Final = (0.05, 1.2)
_MOVED: Final = 2e-3
"""Smallest motion of a leg in a direction, m or rad, for which an overshoot is computed."""
_THERE: Final = 1e-5
"""A set-point this near to its target counts as standing there, m or rad."""
_TORQUE_STEP_SHARE: Final = 1e-3
"""Step of the torque on the bus, per mille of the rated torque."""


def drive(run: TrialRun, seconds: float) -> None:
    """Move to one target after another; nearly a third are abandoned on the way."""
    rng, finished = run.rng, 0
    while run.elapsed_s < seconds:
        target = run.start_random_move()
        run.mark("leg", **run.directions.marked(target, "target"))
        if rng.random() < _FINISHED_SHARE:
            run.arrive()
            rest_s = rng.uniform(*_REST_S)
            run.stay(rest_s if finished % _LONG_EVERY else _LONG_REST_S)
            finished += 1
        else:
            run.stay(rng.uniform(*_CHANGED_AFTER_S))


@dataclass(frozen=True)
class TargetLeg:
    """The rows of one leg, its origin, its target, and where it could stop, (d,) each.

    The set-point stands at the target in the last `stood` rows.
    """

    rows: slice
    origin: FloatArray
    target: FloatArray
    stop: FloatArray
    stood: int

    def overshoot(self, true: FloatArray) -> FloatArray:
        """Return the largest distance of the platform (c, d) beyond its target, per direction.

        It is 0 in a direction in which the leg hardly moves.
        """
        return self._beyond(true, self.target)

    def overshoot_of_rest(self, true: FloatArray, rested: int) -> FloatArray | None:
        """Return the overshoot beyond the place of rest; None if the leg rested < `rested` rows."""
        return None if self.stood < rested else self._beyond(true, true[self.rows][-1])

    def _beyond(self, true: FloatArray, place: FloatArray) -> FloatArray:
        way = self.target - self.origin
        sign = np.sign(way)
        farthest = np.maximum(sign * place, sign * self.stop)
        beyond = (sign * true[self.rows]).max(axis=0) - farthest
        return np.where(np.abs(way) > _MOVED, np.maximum(beyond, 0.0), 0.0)

    def off_m(self, true_m: FloatArray) -> float:
        """Return the largest distance in a direction from the box between origin and target."""
        k = true_m.shape[1]
        corners = np.array([self.origin, self.target, self.stop])[:, :k]
        true = true_m[self.rows]
        out = np.maximum(corners.min(axis=0) - true, true - corners.max(axis=0))
        return max(0.0, float(out.max()))


def legs(recorded: Recorded) -> list[TargetLeg]:
    """Return all legs of a trial.

    If a target changes during a motion, the set-point cannot turn immediately. `stop` is its
    turning point in each direction, perhaps beyond the new target. The acceleration limit and the
    delay of smoothing bound it.
    """
    acceleration, found = recorded.directions.acceleration, []
    for mark, rows in _legs(recorded):
        setpoint = recorded.setpoint_places[max(rows.start - 1, 0) : rows.stop]
        now, speed = setpoint[1], (setpoint[1] - setpoint[0]) / recorded.period_s
        runs_on = np.abs(speed) * (SMOOTHED_S + np.abs(speed) / (2.0 * acceleration))
        turn = np.where(speed > 0.0, setpoint.max(axis=0), setpoint.min(axis=0))
        stop = now + np.clip(turn - now, -runs_on, runs_on)
        stood = _stood(recorded, mark, rows)
        found.append(TargetLeg(rows, recorded.true_places[rows.start], mark, stop, stood))
    return found


def _stood(recorded: Recorded, target: FloatArray, rows: slice) -> int:
    """Return how many of a leg's last rows have the set-point at the target."""
    coming = np.abs(recorded.setpoint_places[rows] - target).max(axis=1) > _THERE
    return coming.size if not coming.any() else int(coming[::-1].argmax())


def _legs(recorded: Recorded) -> list[tuple[FloatArray, slice]]:
    """Return the target and the rows of each leg."""
    marks = recorded.marked("leg")
    first = [recorded.row(mark["cycle"]) for mark in marks]
    ends = zip(first, [*first[1:], len(recorded.truth)], strict=True)
    targets = [recorded.directions.place(mark, "target") for mark in marks]
    return [(target, slice(*rows)) for target, rows in zip(targets, ends, strict=True)]


def swings_s(recorded: Recorded) -> FloatArray:
    """Return how long the platform took to stay within `SWING_mm` of each target, (m,).

    The time begins when the set-point has reached the target. If the platform does not settle, it
    is the duration of the whole rest. Targets with a rest shorter than `SWING_S` are left out.
    """
    found = []
    for target, rows in _legs(recorded):
        k = recorded.directions.k
        off = np.linalg.norm(recorded.true_m[rows] - target[:k], axis=1)
        off = off[off.size - _stood(recorded, target, rows) :]
        if off.size * recorded.period_s >= SWING_S:
            swinging = np.flatnonzero(1e3 * off > SWING_mm)
            found.append(recorded.period_s * (swinging[-1] + 1 if swinging.size else 0))
    return np.array(found)


def judge(recorded: Recorded, robot: Robot) -> list[Figure]:
    """Return the extremes of tension and torque, the worst overshoot, and the longest swing."""
    directions, k = recorded.directions, recorded.directions.k
    found = legs(recorded)
    true = recorded.true_places
    beyond = np.array([leg.overshoot(true) for leg in found]).reshape(-1, directions.d)
    rested = [leg.overshoot_of_rest(true, round(RESTED_S / recorded.period_s)) for leg in found]
    of_rest = [1e3 * float(over[:k].max()) for over in rested if over is not None]
    off = max(leg.off_m(recorded.true_m) for leg in found)
    speed = np.abs(recorded.truth["velocity_m_s"][:, :k]).max(axis=0)
    swings = swings_s(recorded)
    figures = [
        Figure("legs", "legs, each to a random target", len(found)),
        Figure("minutes", "bus time", float(recorded.time_s[-1]) / 60.0, "min"),
        Figure("top_speed_m_s", "fastest along a direction", float(speed.max()), "m/s"),
        *held_figures(recorded, robot),
        Figure("overshoot_mm", "overshoot", 1e3 * float(beyond[:, :k].max()), "mm", OVERSHOOT_mm),
        Figure("off_mm", "farthest from the box of a leg, in any direction", 1e3 * off, "mm"),
    ]
    if of_rest:
        text = "overshoot beyond where the platform came to rest"
        figures.append(Figure("overshoot_of_rest_mm", text, max(of_rest), "mm"))
    if directions.angle_rad > 0.0:
        angle = float(np.degrees(beyond[:, k:].max(initial=0.0)))
        figures.append(Figure("overshoot_deg", "overshoot in angle", angle, "deg"))
    if swings.size:
        text = f"longest time until it stays within {SWING_mm:g} mm of its target"
        figures.append(Figure("swing_s", text, float(swings.max()), "s", SWING_S))
    return figures


def held_figures(recorded: Recorded, robot: Robot) -> list[Figure]:
    """Return the extremes of the true tensions and of the torques, with their limits."""
    limits = limits_of(robot)
    tension, torque = recorded.truth["tension_N"], recorded.truth["torque_Nm"]
    low, high = np.asarray(limits.tension_min_N), np.asarray(limits.tension_max_N)
    slack, most = np.asarray(limits.slack_N), np.asarray(limits.torque_Nm)
    outside = ((tension < low) | (tension > high)).any(axis=1)
    sent = np.abs(recorded.cycles["torque_sent_Nm"])
    rated = np.array([axis.winch.motor.rated_torque_Nm for axis in robot.axes])
    bound = "Nm", float(most.max() + _TORQUE_STEP_SHARE * rated.max())
    return [
        Figure("tension_min_N", "least tension", float(tension.min()), "N", low.min(), True),
        Figure("tension_max_N", "greatest tension", float(tension.max()), "N", high.max()),
        Figure("outside_cycles", "cycles with a tension out of its bounds", outside.sum(), "", 0),
        Figure(
            "slack_cycles", "cycles with a slack cable", (tension < slack).any(axis=1).sum(), "", 0
        ),
        Figure("torque_sent_Nm", "greatest commanded torque of a motor", float(sent.max()), *bound),
        Figure("torque_true_Nm", "greatest torque of a motor", float(np.abs(torque).max()), "Nm"),
    ]

"""Recorded runs that identification works on."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.errors import ControlError

TWO_PI = 2.0 * math.pi
_SHORTEST_TURNS = 0.98
_SHORTEST_S = 0.25


class IdentificationError(ControlError):
    """The recorded runs do not show what was to be identified; the message says what is missing."""


@dataclass(frozen=True)
class SweepData:
    """One recorded run; all arrays have shape (k,), one entry a cycle.

    `angle_rad` is measured from the encoder index and unwrapped; `torque_Nm` is what was sent in
    that cycle, after quantisation; the set-point's position is on the angle's scale.
    """

    time_s: FloatArray
    angle_rad: FloatArray
    torque_Nm: FloatArray
    setpoint_rad: FloatArray
    setpoint_velocity_rad_s: FloatArray


@dataclass(frozen=True)
class Stretch:
    """Samples of one run at one constant set-point velocity: from `start` up to `stop`."""

    run: SweepData
    start: int
    stop: int
    velocity_rad_s: float

    @property
    def direction(self) -> int:
        """+1 for increasing angles, -1 for decreasing ones."""
        return 1 if self.velocity_rad_s > 0.0 else -1

    @property
    def turns(self) -> float:
        """Travel of the set-point in turns."""
        samples = self.stop - self.start
        return samples * period_s(self.run) * abs(self.velocity_rad_s) / TWO_PI

    def last_whole_turns(self) -> Stretch | None:
        """Return the last whole turns of the stretch, None where there is not one."""
        whole = math.floor(self.turns + 1.0 - _SHORTEST_TURNS)
        if whole < 1:
            return None
        samples = round(whole * TWO_PI / (abs(self.velocity_rad_s) * period_s(self.run)))
        start = max(self.start, self.stop - samples)
        return Stretch(self.run, start, self.stop, self.velocity_rad_s)


def period_s(run: SweepData) -> float:
    """Return the cycle time of a run."""
    return float(np.median(np.diff(run.time_s)))


def check_runs(runs: Sequence[SweepData]) -> None:
    """Raise IdentificationError for runs that are empty, ragged or not finite."""
    if not runs:
        raise IdentificationError("no recorded run was given")
    for number, run in enumerate(runs):
        sizes = {name: array.size for name, array in vars(run).items()}
        if len(set(sizes.values())) != 1 or run.time_s.size < 100:
            raise IdentificationError(f"run {number}: lengths {sizes} must be equal and over 100")
        for name, array in vars(run).items():
            if not np.all(np.isfinite(array)):
                raise IdentificationError(f"run {number}: {name} holds values that are not finite")


def stretches(runs: Sequence[SweepData]) -> list[Stretch]:
    """Return all stretches of constant set-point velocity, in the order of the runs."""
    found = []
    for run in runs:
        v = run.setpoint_velocity_rad_s
        steady = np.concatenate([[False], np.abs(np.diff(v)) < 1e-9, [False]])
        edges = np.flatnonzero(np.diff(steady.astype(np.int8)))
        for start, stop in zip(edges[::2], edges[1::2] + 1, strict=True):
            if v[start] != 0.0 and (stop - start) * period_s(run) >= _SHORTEST_S:
                found.append(Stretch(run, int(start), int(stop), float(v[start])))
    return found

"""The second pass: ramps under compensation, each judged before it is believed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cdpr_rt.identification.better import refine
from cdpr_rt.identification.result import BetterResult
from cdpr_rt.identification.sweep import IdentificationError, SweepData, stretches

MOST_ROUNDS = 4
_SAME = 0.2


def roughness_rad(legs: Sequence[SweepData]) -> float:
    """Return the rms deviation from the set-point about its mean, the largest over the legs.

    The last whole turns at constant speed count, so that the start does not. Raises
    IdentificationError where no leg has a whole turn.
    """
    deviations = []
    for stretch in stretches(legs):
        part = stretch.last_whole_turns()
        if part is None:
            continue
        cut = slice(part.start, part.stop)
        deviations.append(float(np.std(part.run.angle_rad[cut] - part.run.setpoint_rad[cut])))
    if not deviations:
        raise IdentificationError("no leg of the second pass holds a whole turn at constant speed")
    return max(deviations)


class SecondPass:
    """Refines a first result round by round and keeps the one under which the rotor ran best.

    Each round: run ramps in both directions under `current`, then `add` what was recorded. A
    refinement is only trusted once a run under it was smooth: where the rotor hunts, what it
    teaches may be wrong. It is `done` when a round ran as smoothly as the best before it, or
    after `MOST_ROUNDS`. `fast_legs` are those the first result came from, without the sweeps.
    """

    def __init__(self, first: BetterResult, fast_legs: Sequence[SweepData]) -> None:
        self.current = first
        """What the next ramps are to be run under."""
        self._known = list(fast_legs)
        self._tried: list[tuple[float, BetterResult]] = []
        self.done = False

    @property
    def best(self) -> BetterResult:
        """The result under which the rotor ran most smoothly; the first where none was run."""
        if not self._tried:
            return self.current
        return min(self._tried, key=lambda tried: tried[0])[1]

    @property
    def roughness_rad(self) -> tuple[float, ...]:
        """How rough each round was."""
        return tuple(rough for rough, _ in self._tried)

    def add(self, legs: Sequence[SweepData]) -> None:
        """Take the ramps that were run under `current`; raises IdentificationError."""
        rough = roughness_rad(legs)
        before = min(self.roughness_rad, default=np.inf)
        self._tried.append((rough, self.current))
        converged = (1.0 - _SAME) * before <= rough <= (1.0 + _SAME) * before
        self.done = converged or len(self._tried) >= MOST_ROUNDS
        self._known += legs
        if not self.done:
            self.current = refine(self.best, self._known)

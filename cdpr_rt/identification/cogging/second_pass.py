"""The second pass: refinement by ramps under compensation."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cdpr_rt.identification.cogging.harmonic_model import refine
from cdpr_rt.identification.cogging.result import HarmonicResult
from cdpr_rt.identification.cogging.sweep import IdentificationError, SweepData, stretches

MOST_ROUNDS = 4
_SAME = 0.2


def rms_deviation_rad(legs: Sequence[SweepData]) -> float:
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
    """Refines a first result round by round; the best is the one with the smallest deviation.

    Each round: run ramps in both directions under `current`, then `add` what was recorded. A
    refinement from runs with hunting may be wrong: it counts by the deviation of the run under it.
    It is `done` when a round is as good as the best before it, or after `MOST_ROUNDS`. `fast_legs`
    are those of the first result, without the sweeps.
    """

    def __init__(self, first: HarmonicResult, fast_legs: Sequence[SweepData]) -> None:
        self.current = first
        """The result that the next ramps are run under."""
        self._known = list(fast_legs)
        self._tried: list[tuple[float, HarmonicResult]] = []
        self.done = False

    @property
    def best(self) -> HarmonicResult:
        """The result with the smallest deviation; the first where none was run."""
        if not self._tried:
            return self.current
        return min(self._tried, key=lambda tried: tried[0])[1]

    @property
    def rms_deviation_rad(self) -> tuple[float, ...]:
        """The deviation of each round."""
        return tuple(deviation_rad for deviation_rad, _ in self._tried)

    def add(self, legs: Sequence[SweepData]) -> None:
        """Take the ramps that were run under `current`; raises IdentificationError."""
        deviation_rad = rms_deviation_rad(legs)
        before = min(self.rms_deviation_rad, default=np.inf)
        self._tried.append((deviation_rad, self.current))
        converged = (1.0 - _SAME) * before <= deviation_rad <= (1.0 + _SAME) * before
        self.done = converged or len(self._tried) >= MOST_ROUNDS
        self._known += legs
        if not self.done:
            self.current = refine(self.best, self._known)

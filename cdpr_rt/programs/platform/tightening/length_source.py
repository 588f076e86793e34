"""Where the cables' lengths come from as they are pulled tight, and the indices that check them."""

from __future__ import annotations

import numpy as np

from cdpr_rt.arrays import BoolArray, FloatArray
from cdpr_rt.core.exchange import AxisFeedback
from cdpr_rt.programs.platform.platform_program import PlatformParts
from cdpr_rt.programs.platform.tightening.home_lengths import LengthsAtHome
from cdpr_rt.robots.persistence.last_lengths import (
    StoppedLengths,
    index_disagreement,
    off_index_m,
)

SOURCES = ("home", "lengths", "last")


class LengthSource:
    """Lengths (n,) by `home`, where the platform stands, by the estimate, or by the last stop.

    `name` is one of `SOURCES`.
    """

    def __init__(self, parts: PlatformParts, cable_m: FloatArray, pretension_N: FloatArray) -> None:
        """Take the pretension at home, (n,)."""
        self._parts, self._cable = parts, cable_m
        self._last: StoppedLengths | None = None
        self.at_home = LengthsAtHome(parts, cable_m, pretension_N)
        self.name = "home"

    @property
    def default(self) -> str:
        """The source where none is asked for."""
        return "lengths" if self._parts.pose_known else "home"

    def begin(self) -> None:
        """Begin anew with the default."""
        self.name, self._last = self.default, None

    def before(self, source: str, feedback: AxisFeedback) -> FloatArray | None:
        """Return the lengths (n,) by what was known of them before, None for nothing."""
        stopped, parts = self._parts.last_stop.lengths, self._parts
        if source == "last" and stopped is not None:
            return stopped.at(feedback.position_rad, self._cable)
        known = parts.pose_known and not parts.last_stop.contradicted
        return parts.estimator.estimate.cable_length_m if known else None

    def take_last(self) -> None:
        """Take the lengths of the last stop, which are nobody's from now on; forget those at home.

        They serve where they are the source.
        """
        last = self._parts.last_stop.take()
        self._last = last if self.name == "last" else None
        self.at_home.forget()

    def now(self, feedback: AxisFeedback) -> FloatArray:
        """Return the cables' lengths, (n,), as they are now."""
        if self.name == "last" and self._last is not None:
            return self._last.at(feedback.position_rad, self._cable)
        if self.name == "lengths":
            return self._parts.estimator.estimate.cable_length_m
        return self.at_home.take(feedback)

    def lacks_index(self, feedback: AxisFeedback) -> BoolArray:
        """Return whose index is missing that compensation needs, or that checks the last lengths.

        It is (n,).
        """
        compensated = self._parts.compensation
        wanted = np.zeros(self._cable.size, np.bool_)
        if compensated is not None:
            wanted |= compensated.available
        if self._last is not None:
            wanted |= np.isfinite(self._last.cable_at_index_m)
        return wanted & ~feedback.index_known

    def check_by_indices(self, feedback: AxisFeedback) -> str:
        """Correct the lengths by the indices; return what these have against the last stop's."""
        self.at_home.correct(feedback)
        parts, last = self._parts, self._parts.last_stop
        last.contradicted = ""
        if self._last is not None:
            length_m, allowed_m = parts.estimator.estimate.cable_length_m, parts.lengths_allowed_m
            off_m = off_index_m(self._last, length_m, feedback, self._cable)
            last.contradicted = index_disagreement(off_m, self._cable, allowed_m, parts.names)
        last.displaced = bool(last.contradicted)
        return last.contradicted

"""Take a platform from pose to pose, and read lengths and tensions where it stands still."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from cdpr_rt.calibration.data import PoseReading
from cdpr_rt.core.exchange import FloatArray
from cdpr_rt.errors import TripError

LOOK_S, SETTLE_S = 0.5, 1.0
"""How long a reading is the mean of, and how long the platform stands before."""
_STILL_m = 1.5e-4
"""Change of a length within a reading beyond which the platform does not stand still."""
_MOST_LOOKS = 10
_MOST_FAILURES = 5


class PoseRefusedError(Exception):
    """The robot does not go to a pose; the message says why. It stands where it was."""


@dataclass(frozen=True)
class Look:
    """What was read over a while."""

    length_m: FloatArray
    """(cycles, n)"""
    tension_N: FloatArray
    position_m: FloatArray | None = None
    """Measured from outside, (3,)."""
    position_std_m: float | None = None
    rotation: FloatArray | None = None
    rotation_std_rad: float | None = None


class PlatformOperator(Protocol):
    """Moves a platform and reads its cables; whatever robot and bus they are on."""

    def go(self, place: FloatArray) -> None:
        """Take it to a place (d,); raises PoseRefusedError, TripError where motion is ended."""

    def stay(self, seconds: float) -> None:
        """Let time pass; raises TripError where the motion is ended meanwhile."""

    def look(self, seconds: float) -> Look:
        """Let time pass and return what was read; raises TripError."""


class PoseNotifier(Protocol):
    """Is told how the procedure goes on."""

    def note(self, text: str) -> None:
        """Take a line."""


def read_pose(operator: PlatformOperator, target: FloatArray) -> PoseReading:
    """Wait until the platform stands still and return what is read there.

    Raises PoseRefusedError where it does not come to rest within some ten looks.
    """
    operator.stay(SETTLE_S)
    for _ in range(_MOST_LOOKS):
        look = operator.look(LOOK_S)
        half = len(look.length_m) // 2
        moved = np.abs(look.length_m[:half].mean(axis=0) - look.length_m[half:].mean(axis=0)).max()
        if moved < _STILL_m:
            return _reading(look, target)
    raise PoseRefusedError(
        f"the platform did not come to rest: a cable still moves by {1e3 * moved:.2f} mm"
    )


@dataclass
class Measured:
    """What a procedure has read so far; it is kept whatever ends it."""

    readings: list[PoseReading] = field(default_factory=list)
    refused: list[str] = field(default_factory=list)
    """Places that were not read, and why."""


def measure_poses(
    operator: PlatformOperator,
    places: Iterable[FloatArray],
    count: int,
    measured: Measured,
    notifier: PoseNotifier,
) -> None:
    """Go to places (d,) until there are `count` readings in `measured`, or no more places.

    Raises TripError where the motion is ended, or where five places in turn do not come to rest.
    """
    readings, refused = measured.readings, measured.refused
    failures = 0
    for place in places:
        if len(readings) >= count:
            break
        try:
            operator.go(place)
        except PoseRefusedError as error:
            refused.append(f"{_listed(place)}: {error}")
            continue
        try:
            readings.append(read_pose(operator, place))
            failures = 0
        except PoseRefusedError as error:
            failures += 1
            refused.append(f"{_listed(place)}: {error}")
            notifier.note(f"pose left out: {error}")
            if failures >= _MOST_FAILURES:
                raise TripError(f"{failures} poses in turn: {error}") from None


def _reading(look: Look, target: FloatArray) -> PoseReading:
    rotation = None
    if look.rotation is not None:
        rotation = tuple(tuple(row) for row in look.rotation.tolist())
    return PoseReading(
        target=tuple(np.asarray(target).tolist()),
        length_m=tuple(look.length_m.mean(axis=0).tolist()),
        tension_N=tuple(look.tension_N.mean(axis=0).tolist()),
        position_m=None if look.position_m is None else tuple(look.position_m.tolist()),
        position_std_m=look.position_std_m,
        rotation=rotation,
        rotation_std_rad=look.rotation_std_rad,
    )


def _listed(place: FloatArray) -> str:
    return ", ".join(f"{x:.3f}" for x in place)

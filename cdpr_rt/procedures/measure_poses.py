"""Move a platform from pose to pose, and read lengths, tensions and markers at each."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.marker_map import Sighting
from cdpr_rt.calibration.readings import ImageReading, PoseReading
from cdpr_rt.errors import TripError

READING_S, SETTLE_S = 0.5, 1.0
"""Averaging time of a reading, and settling time before it."""
_STILL_m = 1.5e-4
"""Change of a length within a reading beyond which the platform does not stand still."""
_MOST_READINGS = 10
_MOST_FAILURES = 5


class PoseRefusedError(Exception):
    """The robot rejects a pose; the message says why. It has not moved."""


class NotThePoseError(TripError):
    """The motion ended for a reason independent of the pose, such as an emergency stop."""


@dataclass(frozen=True)
class TargetNotReached:
    """The platform has not reached its target in time; the robot holds it at its present
    position.
    """

    place: FloatArray
    """Present position (d,), according to the controller."""
    why: str


@dataclass(frozen=True)
class Readings:
    """Readings over some time."""

    length_m: FloatArray
    """(cycles, n)"""
    tension_N: FloatArray
    position_m: FloatArray | None = None
    """Externally measured position, (3,)."""
    position_std_m: float | None = None
    rotation: FloatArray | None = None
    rotation_std_rad: float | None = None


class PoseReader(Protocol):
    """Reads a platform's cables and its camera, on any robot and bus."""

    def wait(self, seconds: float) -> None:
        """Let time pass; raises TripError if the motion ends during that time."""

    def read(self, seconds: float) -> Readings:
        """Let time pass and return the readings; raises TripError."""

    def image(self) -> Sighting | None:
        """Return the markers that the camera sees, None without a camera; raises TripError."""


class PlatformOperator(PoseReader, Protocol):
    """A pose reader that also moves the platform."""

    def move_to(self, place: FloatArray) -> TargetNotReached | None:
        """Move the platform to a position (d,); return None if it has arrived.

        Raises PoseRefusedError, and TripError if the motion ends early.
        """


class PoseNotifier(Protocol):
    """Receives notes about the progress of the procedure."""

    def note(self, text: str) -> None:
        """Show a line of text."""


def read_pose(operator: PoseReader, target: FloatArray) -> PoseReading:
    """Wait until the platform stands still, and return the readings at that pose.

    Raises PoseRefusedError if the platform does not come to rest within about ten readings.
    """
    operator.wait(SETTLE_S)
    for _ in range(_MOST_READINGS):
        readings = operator.read(READING_S)
        half = len(readings.length_m) // 2
        moved = np.abs(
            readings.length_m[:half].mean(axis=0) - readings.length_m[half:].mean(axis=0)
        ).max()
        if moved < _STILL_m:
            return _reading(readings, target, operator.image())
    raise PoseRefusedError(
        f"the platform did not come to rest: a cable still moves by {1e3 * moved:.2f} mm"
    )


@dataclass
class Measured:
    """Readings of a procedure so far; `keep` is called after each addition."""

    keep: Callable[[], None]
    readings: list[PoseReading] = field(default_factory=list)
    refused: list[str] = field(default_factory=list)
    """Positions that were not read, with the reasons."""
    tried: list[tuple[float, ...]] = field(default_factory=list)
    """Positions (d,) that were not read or not reached, and are not tried again."""
    failures: int = 0
    """Number of successive positions that were not reached, or at which the platform did not come
    to rest."""

    def add(self, reading: PoseReading) -> None:
        """Add a reading."""
        self.readings.append(reading)
        self.keep()

    def leave_out(self, place: FloatArray, why: str) -> None:
        """Leave out a position (d,) that cannot be read."""
        self.refused.append(f"{_listed(place)}: {why}")
        self.tried.append(tuple(place.tolist()))

    def interrupted(self, place: FloatArray, error: TripError) -> None:
        """Leave out a position (d,) at which the motion ended, if the position may be the cause."""
        if not isinstance(error, NotThePoseError):
            # the same may happen there again
            self.leave_out(place, str(error))


def measure_poses(
    operator: PlatformOperator,
    places: Iterable[FloatArray],
    between: FloatArray,
    measured: Measured,
    notifier: PoseNotifier,
) -> None:
    """Move to positions (d,) and read each; go through `between` if the straight way is rejected.

    If a position is not reached, the reading is taken where the platform stands, also on the way
    through `between`. Raises TripError if the motion is ended, or if the platform does not reach
    five successive positions or does not come to rest there.
    """
    for place in places:
        what = f"pose {len(measured.readings) + 1}, at {_listed(place)}"
        try:
            held = _go(operator, place, between)
        except PoseRefusedError as error:
            measured.leave_out(place, str(error))
            notifier.note(f"{what}, is left out: {error}")
            continue
        except TripError as error:
            measured.interrupted(place, error)
            raise
        failure = _read(operator, place, held, measured)
        measured.failures = measured.failures + 1 if failure else 0
        if failure:
            notifier.note(f"{what}, {failure}")
        if measured.failures >= _MOST_FAILURES:
            raise TripError(
                f"{measured.failures} poses in a row failed, the last {what}, {failure}"
            )


def _go(
    operator: PlatformOperator, place: FloatArray, between: FloatArray
) -> TargetNotReached | None:
    try:
        return operator.move_to(place)
    except PoseRefusedError:
        held = operator.move_to(between)
        if held is None:
            return operator.move_to(place)
        return replace(held, why=f"on its way through {_listed(between)} {held.why}")


def _read(
    operator: PlatformOperator, place: FloatArray, held: TargetNotReached | None, measured: Measured
) -> str:
    """Read the pose at which the platform stands; return the problem, or ""."""
    try:
        reading = read_pose(operator, place if held is None else held.place)
    except PoseRefusedError as error:
        why = str(error) if held is None else f"{held.why}; {error}"
        measured.leave_out(place, why)
        return f"is left out: {why}"
    except TripError as error:
        measured.interrupted(place, error)
        raise
    if held is not None:
        measured.tried.append(tuple(place.tolist()))
    measured.add(reading)
    return "" if held is None else f"is read where the platform stands: {held.why}"


def _reading(readings: Readings, target: FloatArray, seen: Sighting | None) -> PoseReading:
    rotation = None
    if readings.rotation is not None:
        rotation = tuple(tuple(row) for row in readings.rotation.tolist())
    return PoseReading(
        target=tuple(np.asarray(target).tolist()),
        length_m=tuple(readings.length_m.mean(axis=0).tolist()),
        tension_N=tuple(readings.tension_N.mean(axis=0).tolist()),
        position_m=None if readings.position_m is None else tuple(readings.position_m.tolist()),
        position_std_m=readings.position_std_m,
        rotation=rotation,
        rotation_std_rad=readings.rotation_std_rad,
        image=None if seen is None else ImageReading.of(seen),
    )


def _listed(place: FloatArray) -> str:
    return ", ".join(f"{x:.3f}" for x in place)

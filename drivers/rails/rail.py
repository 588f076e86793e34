"""Moves a rail: checks slack cables and brake, voids the calibration, brakes at the end."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Protocol

from cdpr_drivers.errors import DriverError
from cdpr_profiles.devices.rail import RailProfile
from cdpr_rt.core.clock import Clock
from cdpr_rt.robots.persistence.calibration_state import mark_not_calibrated

_LOOK_S: Final = 0.01
_SETTLE_S: Final = 0.3
_EXTRA_TIME_S: Final = 3.0
"""Time that a move may take beyond twice its nominal time."""
_VOIDED: Final = "; the robot is not calibrated any more"


class RailError(DriverError):
    """A rail was not moved, or not to its end; says why."""


class RailStoppedError(RailError):
    """The operator asked for a stop; the rail was stopped and braked."""


class RailAxis(Protocol):
    """One position axis with a holding brake; methods raise DriverError."""

    def check(self) -> None:
        """Raise when the axis has a fault, or its safety I/O has tripped or does not answer."""

    def position_m(self) -> float:
        """Return where the carriage is."""

    def enable(self) -> None:
        """Switch the power stage on, standing still."""

    def disable(self) -> None:
        """Take the power away."""

    def push(self, share: float) -> bool:
        """Push with a share of the rated torque, 0 to end; return False where it cannot."""

    def start(self, target_m: float) -> None:
        """Begin to move to a position; the axis is enabled."""

    def arrived(self) -> bool:
        """Return whether the move has come to its end."""

    def halt(self) -> None:
        """Stop on the drive's ramp and wait until it stands still."""

    def set_brake(self, released: bool) -> None:
        """Release or apply the brake, and wait for its feedback."""


@dataclass(frozen=True)
class MoveResult:
    """Result of a move."""

    from_m: float
    to_m: float
    brake_moved_m: float | None
    """How far the applied brake let the carriage be pushed; None where the drive cannot push."""


@dataclass(frozen=True)
class MoveConditions:
    """Conditions of a move, checked before and during it."""

    cables_tight: Callable[[], str]
    """Why the cables do not count as slack, or an empty text."""
    powered: Callable[[], str]
    """Which winch has power, or an empty text."""
    stop_requested: Callable[[], bool]
    progress: Callable[[float], None]
    """Told the position in m."""


def move(
    rail: RailProfile, axis: RailAxis, clock: Clock, target_m: float, conditions: MoveConditions
) -> MoveResult:
    """Move the rail to `target_m`; however it ends, the axis is braked and without power.

    The robot is marked as not calibrated before the carriage moves. Raises RailError for
    cables that are tight, winches with power, a brake that does not hold, a target beyond the
    travel or a move that does not arrive, RailStoppedError on request, StateFileError and what the
    axis raises.
    """
    if not rail.travel_min_m <= target_m <= rail.travel_max_m:
        raise RailError(
            f"{rail.name}: target {target_m:g} m; allowed: {rail.travel_min_m:g} to "
            f"{rail.travel_max_m:g} m"
        )
    _refuse(rail, conditions)
    axis.check()
    start_m = axis.position_m()
    try:
        axis.set_brake(False)
        pushed_m = _test_brake(rail, axis, clock)
        _stop_on_request(rail, conditions, voided="")
        _void_calibration(rail, clock, f"{rail.name} was moved from {start_m:.4f} m")
        _refuse(rail, conditions, voided=_VOIDED)  # the disk may have taken its time
        axis.check()
        _stop_on_request(rail, conditions)
        axis.enable()
        axis.set_brake(True)
        try:
            axis.start(target_m)
            _follow(rail, axis, clock, abs(target_m - start_m), conditions)
        except BaseException:
            with contextlib.suppress(DriverError):
                axis.halt()
            raise
    finally:
        _hold(axis, clock)
    end_m = axis.position_m()
    if abs(end_m - target_m) > rail.tolerance_m:
        raise RailError(
            f"{rail.name}: stands at {end_m:.4f} m after it was braked, {target_m:.4f} m was "
            f"wanted ({rail.tolerance_m:g} m allowed): does the brake hold?"
        )
    return MoveResult(start_m, end_m, pushed_m)


def _void_calibration(rail: RailProfile, clock: Clock, why: str) -> None:
    """Write it down while the drive goes on hearing its master: a disk may take a second."""
    clock.run_blocking(lambda: mark_not_calibrated(rail.robot, why))


def _refuse(rail: RailProfile, conditions: MoveConditions, voided: str = "") -> None:
    if tight := conditions.cables_tight():
        raise RailError(f"{rail.name}: not moved unless the cables are slack: {tight}{voided}")
    if powered := conditions.powered():
        raise RailError(f"{rail.name}: not moved while a winch has power: {powered}{voided}")


def _stop_on_request(rail: RailProfile, conditions: MoveConditions, voided: str = _VOIDED) -> None:
    if conditions.stop_requested():
        raise RailStoppedError(f"{rail.name}: stopped on request{voided}")


def _test_brake(rail: RailProfile, axis: RailAxis, clock: Clock) -> float | None:
    """Push against the applied brake, both ways; return the movement, None where none can push."""
    check = rail.brake_check
    before, moved = axis.position_m(), 0.0
    for way in (1.0, -1.0):
        if not axis.push(way * check.torque_percent / 100.0):
            return None
        deadline = clock.now_s + check.seconds
        over = False
        while not over:
            over = clock.now_s >= deadline  # the last look is after all of it, however late
            moved = max(moved, abs(axis.position_m() - before))
            if moved > check.allowed_m:
                break
            clock.sleep(_LOOK_S)
    axis.push(0.0)
    if moved > check.allowed_m:
        _void_calibration(rail, clock, f"{rail.name} slipped by {moved * 1e3:.2f} mm on its brake")
        raise RailError(
            f"{rail.name}: the applied brake does not hold: pushed with {check.torque_percent:g} % "
            f"of the rated torque the carriage moved {moved * 1e3:.2f} mm "
            f"({check.allowed_m * 1e3:g} mm allowed)"
        )
    return moved


def _follow(
    rail: RailProfile, axis: RailAxis, clock: Clock, distance_m: float, conditions: MoveConditions
) -> None:
    nominal_s = distance_m / rail.speed_m_s + rail.speed_m_s / rail.acceleration_m_s2
    allowed_s = 2.0 * nominal_s + _EXTRA_TIME_S
    began = clock.now_s
    while not axis.arrived():
        axis.check()
        conditions.progress(axis.position_m())
        _stop_on_request(rail, conditions)
        cables_tight = conditions.cables_tight()
        if cables_tight:
            raise RailError(
                f"{rail.name}: stopped, for the cables are not slack any more: {cables_tight}"
            )
        powered = conditions.powered()
        if powered:
            raise RailError(f"{rail.name}: stopped, for a winch may have power: {powered}")
        if clock.now_s - began > allowed_s:
            raise RailError(f"{rail.name}: did not arrive within {allowed_s:.1f} s")
        clock.sleep(_LOOK_S)


def _hold(axis: RailAxis, clock: Clock) -> None:
    """Apply the brake before the drive lets go; the power goes even if the brake does not."""
    try:
        axis.set_brake(False)
    finally:
        axis.disable()
    clock.sleep(_SETTLE_S)  # time in which a slipping brake shows

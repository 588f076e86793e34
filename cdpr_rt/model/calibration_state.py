"""Whether a robot is calibrated, stored in a small file that outlives the commands."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from cdpr_rt.state_file import StateFileError, read_state, state_path, write_state


@dataclass(frozen=True)
class CalibrationState:
    """Whether a robot's geometry is reliable."""

    robot: str
    calibrated: bool
    why: str
    """Cause of the state: the calibration, or the part that has moved."""
    date: str
    """Date as ISO 8601, UTC; empty if no state has been stored yet."""


def calibrated_flag_file(robot: str) -> Path:
    """Return the file that holds the robot's state."""
    return state_path("calibration", robot)


def calibration_state(robot: str) -> CalibrationState:
    """Return the robot's state: not calibrated if the file is missing or damaged."""
    path = calibrated_flag_file(robot)
    try:
        held = read_state(path)
    except StateFileError as error:
        return CalibrationState(robot, False, str(error), "")
    if held is None:
        return CalibrationState(robot, False, "it has never been calibrated", "")
    calibrated, why, date = (held.get(key) for key in ("calibrated", "why", "date"))
    if not (isinstance(calibrated, bool) and isinstance(why, str) and isinstance(date, str)):
        problem = f"{path}: is damaged: it needs the keys calibrated, why and date"
        return CalibrationState(robot, False, problem, "")
    return CalibrationState(robot, calibrated, why, date)


def mark_calibrated(robot: str, why: str) -> CalibrationState:
    """Store that the robot is calibrated; raises StateFileError."""
    return _mark(robot, True, why)


def mark_not_calibrated(robot: str, why: str) -> CalibrationState:
    """Store that the robot's geometry is unreliable; raises StateFileError."""
    return _mark(robot, False, why)


def not_calibrated_reason(robot: str) -> str:
    """Return the reason why a robot's geometry is unreliable, or "" if it is reliable.

    The geometry of a robot that has never been calibrated is that of its file, and is reliable.
    """
    if not calibrated_flag_file(robot).exists():
        return ""
    state = calibration_state(robot)
    if state.calibrated:
        return ""
    since = f" since {state.date}" if state.date else ""
    return (
        f"robot {robot!r} is not calibrated{since}: {state.why}; calibrate it, or "
        "confirm its geometry (`cdpr robot mark-calibrated ROBOT --why ...`, with "
        "ROBOT as for `cdpr run`), and switch it off and on: `cdpr disable`, `cdpr "
        "enable`, `cdpr tighten`"
    )


def _mark(robot: str, calibrated: bool, why: str) -> CalibrationState:
    date = datetime.now(UTC).isoformat(timespec="seconds")
    state = CalibrationState(robot, calibrated, why, date)
    held = {"robot": robot, "calibrated": calibrated, "why": why, "date": date}
    write_state(calibrated_flag_file(robot), held)
    return state

"""Measure the cogging of one motor of a running robot, as a script on its handle."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np

from cdpr_profiles import Robot as Profile
from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.cycle_row import Row
from cdpr_rt.identification.cogging_profile import DriveIdentity
from cdpr_rt.identification.commissioning_results import Paths
from cdpr_rt.identification.rawlog import AXIS_COLUMNS, RawLogWriter, column_names
from cdpr_rt.robot import Error, Robot
from cdpr_tools.commission.commissioning import SWEEP_LEAD_IN_RAD
from cdpr_tools.errors import BadInputError, WorkFailedError
from cdpr_tools.output import Output

_FAST_LEGS: Final = (
    (math.radians(300.0), 3.0 * math.tau),
    (math.radians(600.0), 3.0 * math.tau),
    (math.radians(90.0), 1.0 * math.tau),
    (math.radians(12.0), 0.25 * math.tau),
)
"""Speed and distance, there and back: fast turns for inertia and viscous friction, slower turns for
the friction curve."""
_INDEX_SPEED_RAD_S, _INDEX_RAD = math.radians(90.0), 1.2 * math.tau
_FULL_SPEED_SHARE = 0.999
FIELDS: Final = ("cycle", "time_s", "program", *AXIS_COLUMNS)
"""Fields of the log that `write_passes` needs."""


@dataclass(frozen=True)
class SweptAxis:
    """The axis to be measured, from the description of a running daemon."""

    place: int
    name: str
    programs: Sequence[str]
    identity: dict[str, Any]
    """Identity of winch, motor and drive, as stored in raw logs."""
    latency_s: float
    period_s: float
    is_simulated: bool

    @classmethod
    def of(
        cls, description: Mapping[str, Any], status: Mapping[str, Any], name: str, robot: Profile
    ) -> SweptAxis:
        """Return the axis called `name` of the daemon's `robot`; raises BadInputError."""
        places = {axis.name: i for i, axis in enumerate(robot.axes)}
        if name not in places:
            raise BadInputError(
                f"{name}: not an axis of {robot.name}; allowed: {', '.join(places)}"
            )
        if "sweep" not in description.get("programs", ()):
            raise BadInputError(
                f"{robot.name}: its motors share a platform; end the daemon, take the cables "
                f"off, and use `cdpr commission {robot.profile} --axis {name!r}`"
            )
        if status["read_only"]:
            raise BadInputError(f"{robot.name}: its daemon only listens (--read-only)")
        if not status["parts"].get("recording", {}).get("recording"):
            raise BadInputError(
                f"{robot.name}: its daemon does not record; start `cdpr run` without --no-record"
            )
        if status["state"] != "ready":
            raise BadInputError(f"{robot.name} is {status['state']}; allowed: ready, without power")
        axis = robot.axes[places[name]]
        bus = status["buses"][axis.bus]
        drive = DriveIdentity.model_validate(bus["drives"][name])
        whose = {"winch": axis.winch.reference, "motor": axis.winch.motor.model}
        return cls(
            places[name],
            name,
            description["programs"],
            whose | drive.model_dump(),
            axis.winch.latency_s,
            float(description["period_s"]),
            str(bus["url"]).startswith("simbus:"),
        )


def sweep(robot: Robot, axis: SweptAxis, turns: int, speed_rad_s: float, out: Output) -> None:
    """Find the index of one motor, sweep it in both directions, and turn it at other speeds.

    The other axes hold their positions. The drives have no power afterwards, even after an error.
    """

    def distances(distance_rad: float) -> list[float]:
        return [distance_rad if place == axis.place else 0.0 for place in range(len(robot.axes))]

    robot.enable()
    try:
        out.note("turning until the encoder's index passes ...")
        robot.turn_by(distances(_INDEX_RAD), speed_rad_s=_INDEX_SPEED_RAD_S)
        if not robot.status["axes"][axis.place]["index_known"]:
            turned = f"{_INDEX_RAD / math.tau:g} turns"
            raise WorkFailedError(f"{axis.name}: no encoder index was found in {turned}")
        angle_rad = SWEEP_LEAD_IN_RAD + turns * math.tau
        out.note(f"sweeping in both directions, {2.0 * angle_rad / speed_rad_s / 60.0:.1f} min ...")
        robot.run("sweep", distance_rad=distances(angle_rad), speed_rad_s=speed_rad_s, legs=2)
        out.note("turning at other speeds ...")
        for speed, distance in _FAST_LEGS:
            for turn in (distance, -distance):
                robot.turn_by(distances(turn), speed_rad_s=speed)
    except BaseException:
        with suppress(Error):  # the error that ended the motion says more
            robot.disable()
        raise
    robot.disable()


def write_passes(rows: Row, axis: SweptAxis, paths: Paths) -> list[Path]:
    """Write each leg of the sweep and each fast turn as a raw log of one axis; return the files.

    Raises WorkFailedError if the recording does not contain them all.
    """
    moves = _moves(rows, axis)
    number = axis.programs.index("sweep")
    sweeps = [move for move in moves if rows["program"][move.start] == number]
    last = sweeps[-1].stop if sweeps else 0
    fast = [move for move in moves if move.start >= last]
    if (len(sweeps), len(fast)) != (2, 2 * len(_FAST_LEGS)):
        raise WorkFailedError(
            f"{axis.name}: the recording has {len(sweeps)} of 2 sweep legs and {len(fast)} of "
            f"{2 * len(_FAST_LEGS)} fast turns"
        )
    written = []
    for name, some in (("sweep", sweeps), ("fast", fast)):
        for k, move in enumerate(some):
            path = paths.raw(f"{name}-{k}")
            _write(path, name, rows[move], axis)
            written.append(path)
    return written


def _moves(rows: Row, axis: SweptAxis) -> list[slice]:
    """Return the rows in which the axis' set-point moves in one direction under one program."""
    direction = np.sign(rows["setpoint_velocity_rad_s"][:, axis.place])
    changes = (np.diff(direction) != 0.0) | (np.diff(rows["program"].astype(int)) != 0)
    edges = [0, *(np.flatnonzero(changes) + 1).tolist(), direction.size]
    moved = {axis.programs.index(name) for name in ("sweep", "pid")}
    return [
        slice(begin, end)
        for begin, end in pairwise(edges)
        if begin < end and direction[begin] and int(rows["program"][begin]) in moved
    ]


def _write(path: Path, name: str, rows: Row, axis: SweptAxis) -> None:
    speed = rows["setpoint_velocity_rad_s"][:, axis.place]
    since_s = (rows["cycle"] - rows["cycle"][0]) * axis.period_s
    begin_s, end_s = 0.0, float(since_s[-1]) + axis.period_s
    if name == "sweep":  # use only full speed, after friction and controller have settled
        angle = rows["setpoint_rad"][:, axis.place]
        full = np.abs(speed) >= _FULL_SPEED_SHARE * np.abs(speed).max()
        counts = since_s[full & (np.abs(angle - angle[0]) >= SWEEP_LEAD_IN_RAD)]
        begin_s, end_s = float(counts[0]), float(counts[-1])
    meta = {
        "what": name,
        "identity": axis.identity,
        "latency_s": axis.latency_s,
        "axes": 1,
        "period_s": axis.period_s,
        "speed_rad_s": float(speed[np.argmax(np.abs(speed))]),
        "measured_from_s": begin_s,
        "measured_until_s": end_s,
        "first_cycle": int(rows["cycle"][0]),
    }
    log = RawLogWriter(path, column_names(1), meta)
    try:
        log.write(_raw(rows, axis.place))
    finally:
        log.close()


def _raw(rows: Row, place: int) -> FloatArray:
    columns = [rows["cycle"], rows["time_s"], *(rows[name][:, place] for name in AXIS_COLUMNS)]
    return np.stack(columns, axis=1).astype(float)

"""Measurement of one motor of a running robot by the daemon's programs and recording."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np

from cdpr_profiles import Robot
from cdpr_rt.arrays import FloatArray
from cdpr_rt.identification.cogging_profile import DriveIdentity
from cdpr_rt.identification.rawlog import AXIS_COLUMNS, RawLogWriter, column_names
from cdpr_rt.procedures.commissioning.commission_files import Paths
from cdpr_rt.procedures.commissioning.winch_passes import SWEEP_LEAD_IN_RAD
from cdpr_rt.service.recordings.recording_reader import Columns, RecordingReader
from cdpr_tools.client.client import Daemon, HeldRight
from cdpr_tools.client.motion import await_end
from cdpr_tools.errors import BadInputError, WorkFailedError
from cdpr_tools.output import Output

_FAST_LEGS: Final = (
    (math.radians(300.0), 3.0 * math.tau),
    (math.radians(600.0), 3.0 * math.tau),
    (math.radians(90.0), 1.0 * math.tau),
    (math.radians(12.0), 0.25 * math.tau),
)
"""Speed and distance, each there and back: quick turns for inertia and viscous friction, slower
ones for the friction curve."""
_INDEX_SPEED_RAD_S, _INDEX_RAD = math.radians(90.0), 1.2 * math.tau
_FULL_SPEED_SHARE = 0.999
_FIELDS: Final = ("cycle", "time_s", "stamp_ns", "program", *AXIS_COLUMNS)
_SAFE_S, _ATTEMPTS = 1.0, 10
"""Nothing older than a second is missing in a recording, unless the disk is slow."""


@dataclass(frozen=True)
class SweptAxis:
    """The axis to be measured, as a running daemon describes it."""

    place: int
    name: str
    programs: Sequence[str]
    identity: dict[str, Any]
    """Of winch, motor and drive, as raw logs keep it."""
    latency_s: float
    period_s: float
    is_simulated: bool

    @classmethod
    def of(cls, daemon: Daemon, name: str, robot: Robot) -> SweptAxis:
        """Return the axis called `name` of the daemon's `robot`; raises BadInputError."""
        description, status = daemon.get("/description"), daemon.get("/status")
        places = {axis.name: i for i, axis in enumerate(robot.axes)}
        if name not in places:
            raise BadInputError(f"{name}: no axis of {robot.name}; allowed: {', '.join(places)}")
        if "sweep" not in description.get("programs", ()):
            raise BadInputError(
                f"{robot.name}: its cables hold a platform together; end the daemon, take them "
                f"off, and use `cdpr commission {robot.profile} --axis {name!r}`"
            )
        if status["read_only"]:
            raise BadInputError(f"{robot.name}: its daemon only listens (--read-only)")
        if not status["parts"].get("recording", {}).get("recording"):
            raise BadInputError(f"{robot.name}: its daemon records nothing; start it to record")
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


@dataclass(frozen=True)
class RecordedSpan:
    """An interval of a daemon's recording."""

    first: Path
    last: Path
    """The files that were written to at its two ends."""
    begin_ns: int
    end_ns: int
    """CLOCK_MONOTONIC, as the rows have it."""

    def rows(self) -> Columns:
        """Return its rows, once they are in the file; raises WorkFailedError, RecordingError."""
        found = sorted(self.first.parent.glob("*.mcap"))
        paths = [path for path in found if self.first.name <= path.name <= self.last.name]
        for _ in range(_ATTEMPTS):
            time.sleep(_SAFE_S)
            rows = [part for path in paths for part in self._within(path)]
            if rows and rows[-1]["stamp_ns"][-1] > self.end_ns:
                joined = {name: np.concatenate([part[name] for part in rows]) for name in rows[0]}
                counts = joined["stamp_ns"] <= self.end_ns
                return {name: column[counts] for name, column in joined.items()}
        raise WorkFailedError(f"{self.last}: ends before the motion does")

    def _within(self, path: Path) -> Iterator[Columns]:
        """Yield a file's rows from the beginning on; those before may be those of days."""
        for rows in RecordingReader(path).cycles(_FIELDS):
            counts = rows["stamp_ns"] >= self.begin_ns
            if counts.any():
                yield {name: column[counts] for name, column in rows.items()}


class AxisSweep:
    """Turns one axis of a daemon whose right to move is held; the others hold where they are.

    `stop_requested` ends it between two looks at the daemon. Raises WorkFailedError where it or the
    daemon ends the motion; the drives are to be disabled by the caller.
    """

    def __init__(
        self,
        control: HeldRight,
        axis: SweptAxis,
        stop_requested: Callable[[], bool],
        out: Output,
    ) -> None:
        self._out = out
        self._control = control
        self._axis = axis
        self._stop_requested = stop_requested

    def run(self, turns: int, speed_rad_s: float) -> RecordedSpan:
        """Find the index, sweep there and back, turn at other speeds; return when that was."""
        begin_ns, first = time.monotonic_ns(), self._file()
        self._out.note("turning until the encoder's index passes ...")
        self._turn(_INDEX_RAD, _INDEX_SPEED_RAD_S)
        if not self._status()["axes"][self._axis.place]["index_known"]:
            turned = f"{_INDEX_RAD / math.tau:g} turns"
            raise WorkFailedError(f"{self._axis.name}: no encoder index was seen in {turned}")
        distances = self._distances(SWEEP_LEAD_IN_RAD + turns * math.tau)
        minutes = 2.0 * (SWEEP_LEAD_IN_RAD + turns * math.tau) / speed_rad_s / 60.0
        self._out.note(f"sweeping there and back, {minutes:.1f} min ...")
        self._run("sweep", {"distance_rad": distances, "speed_rad_s": speed_rad_s, "legs": 2})
        self._out.note("turning at other speeds ...")
        for speed, distance in _FAST_LEGS:
            self._turn(distance, speed)
            self._turn(-distance, speed)
        self._control.hold()
        return RecordedSpan(first, self._file(), begin_ns, time.monotonic_ns())

    def _turn(self, distance_rad: float, speed_rad_s: float) -> None:
        distances = self._distances(distance_rad)
        self._run("pid", {"distance_rad": distances, "speed_rad_s": speed_rad_s})

    def _distances(self, distance_rad: float) -> list[float]:
        others = [0.0] * len(self._status()["axes"])
        others[self._axis.place] = distance_rad
        return others

    def _run(self, program: str, arguments: dict[str, Any]) -> None:
        self._control.post("/program", {"program": program, "wanted": arguments})
        out = self._out if program == "sweep" else None  # the others take a moment
        if await_end(self._control, program, self._stop_requested, math.inf, out) is None:
            raise WorkFailedError(f"{self._axis.name}: stopped on request")

    def _status(self) -> dict[str, Any]:
        return self._control.daemon.get("/status")

    def _file(self) -> Path:
        recording = self._status()["parts"]["recording"]
        if not recording["recording"]:
            raise WorkFailedError(f"the daemon does not record any more: {recording['error']}")
        return Path(recording["file"])


def write_passes(rows: Columns, axis: SweptAxis, paths: Paths) -> list[Path]:
    """Write each leg of the sweep and each fast turn as a raw log of one axis; return their files.

    Raises WorkFailedError where the recording does not hold them all.
    """
    moves = _moves(rows, axis)
    number = axis.programs.index("sweep")
    sweeps = [move for move in moves if rows["program"][move.start] == number]
    last = sweeps[-1].stop if sweeps else 0
    fast = [move for move in moves if move.start >= last]
    if (len(sweeps), len(fast)) != (2, 2 * len(_FAST_LEGS)):
        raise WorkFailedError(
            f"{axis.name}: {len(sweeps)} legs of a sweep and {len(fast)} fast turns recorded; "
            f"2 and {2 * len(_FAST_LEGS)} were run"
        )
    written = []
    for name, some in (("sweep", sweeps), ("fast", fast)):
        for k, move in enumerate(some):
            path = paths.raw(f"{name}-{k}")
            _write(path, name, {key: column[move] for key, column in rows.items()}, axis)
            written.append(path)
    return written


def _moves(rows: Columns, axis: SweptAxis) -> list[slice]:
    """Return where the axis' set-point moves in one direction under one program."""
    direction = np.sign(rows["setpoint_velocity_rad_s"][:, axis.place])
    changes = (np.diff(direction) != 0.0) | (np.diff(rows["program"].astype(int)) != 0)
    edges = [0, *(np.flatnonzero(changes) + 1).tolist(), direction.size]
    moved = {axis.programs.index(name) for name in ("sweep", "pid")}
    return [
        slice(begin, end)
        for begin, end in pairwise(edges)
        if begin < end and direction[begin] and int(rows["program"][begin]) in moved
    ]


def _write(path: Path, name: str, rows: Columns, axis: SweptAxis) -> None:
    speed = rows["setpoint_velocity_rad_s"][:, axis.place]
    since_s = (rows["cycle"] - rows["cycle"][0]) * axis.period_s
    begin_s, end_s = 0.0, float(since_s[-1]) + axis.period_s
    if name == "sweep":  # at full speed, after friction and controller have settled
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


def _raw(rows: Columns, place: int) -> FloatArray:
    columns = [rows["cycle"], rows["time_s"], *(rows[name][:, place] for name in AXIS_COLUMNS)]
    return np.stack(columns, axis=1).astype(float)

"""A robot on its simulator for the procedure of calibration, with a scanner beside it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from scipy.spatial.transform import Rotation

from cdpr_profiles.reading.bounded_input import parse_json
from cdpr_rt.core.exchange import FloatArray
from cdpr_rt.errors import TripError
from cdpr_rt.procedures.calibration.measure_poses import Look, PoseRefusedError
from cdpr_tools.errors import WorkFailedError
from cdpr_tools.trials.directions import Directions, platform_of
from cdpr_tools.trials.lockstep import CommandRefusedError, LockstepRobot
from cdpr_tools.trials.run import TrialRun

_TIGHTEN_S, _MOVE_S = 180.0, 60.0
_HEADER_BYTES = 1024
_SPEED_SHARE = 0.5
"""Of the speed of the robot's file: a robot that is not calibrated yet is not hurried."""


class ScannerTail:
    """The log of a simulated scanner, read while it is written."""

    def __init__(self, path: Path) -> None:
        self._path = path
        with path.open("rb") as file:
            header = parse_json(file.read(_HEADER_BYTES), path)
        self._dtype = np.dtype(
            [(name, kind, *map(tuple, shape)) for name, kind, *shape in header["fields"]]
        )
        self.position_std_m = float(header["position_sigma_m"])
        self.rotation_std_rad = float(header["rotation_sigma_rad"])

    def count(self) -> int:
        """Return how many readings there are."""
        return (self._path.stat().st_size - _HEADER_BYTES) // self._dtype.itemsize

    def since(self, first: int) -> tuple[FloatArray, FloatArray]:
        """Return positions (k, 3) and rotations (k, 3, 3) from a reading on."""
        offset = _HEADER_BYTES + first * self._dtype.itemsize
        rows = np.fromfile(self._path, self._dtype, count=self.count() - first, offset=offset)
        return np.array(rows["position_m"]), np.array(rows["rotation"])


class RigOperator:
    """Moves the platform of a simulated robot over its bus; a `PlatformOperator`."""

    def __init__(
        self, rig: LockstepRobot, scanner: ScannerTail | None, advance: Callable[[float], None]
    ) -> None:
        self.rig = rig
        self.directions = Directions.of(platform_of(rig.robot))
        self._scanner, self._advance = scanner, advance
        self._begun_s = rig.now_s

    def tighten(self) -> FloatArray:
        """Take up the slack at home; return the place there, (d,)."""
        rig, platform = self.rig, platform_of(self.rig.robot)
        rig.enable()
        rig.carry_out("tighten", _TIGHTEN_S)
        self._begun_s = rig.now_s
        return np.pad(np.array(platform.home_m), (0, self.directions.d - self.directions.k))

    def go(self, place: FloatArray) -> None:
        """Take it to a place (d,); raises PoseRefusedError, TripError."""
        speed = _SPEED_SHARE * float(self.directions.speed[0])
        try:
            self.rig.program("pose", **self.directions.arguments(place, speed))
        except CommandRefusedError as error:
            raise PoseRefusedError(str(error)) from None
        try:
            self.rig.finish(_MOVE_S + self._longest_s(speed))
        except WorkFailedError as error:
            raise TripError(str(error)) from None
        self._advance(self.rig.now_s - self._begun_s)

    def _longest_s(self, speed_m_s: float) -> float:
        directions = self.directions
        ways = [np.linalg.norm(directions.high_m - directions.low_m) / speed_m_s]
        if directions.turns:
            share = speed_m_s / directions.speed[0]
            ways.append(2.0 * math.pi / (share * directions.speed[-1]))
        return 2.0 * float(max(ways))

    def stay(self, seconds: float) -> None:
        """Let bus time pass; raises TripError where the motion is ended meanwhile."""
        rig = self.rig
        before = rig.loop.engine.program
        rig.turn(round(seconds / rig.period_s))
        if rig.loop.engine.program is not before:
            raise TripError(f"the motion was ended: {rig.state_text()}")

    def look(self, seconds: float) -> Look:
        """Let bus time pass and return lengths, tensions, and what the scanner has measured."""
        rig, scanner = self.rig, self._scanner
        first = 0 if scanner is None else scanner.count()
        rows = rig.run(seconds)
        lengths, tensions = np.array(rows["cable_length_m"]), np.array(rows["tension_N"])
        if scanner is None:
            return Look(lengths, tensions)
        position, rotation = scanner.since(first)
        if not len(position):
            return Look(lengths, tensions)
        better = math.sqrt(len(position))
        turn = Rotation.from_matrix(rotation).mean().as_matrix()
        return Look(
            lengths, tensions, position.mean(axis=0), scanner.position_std_m / better,
            turn, scanner.rotation_std_rad / better,
        )  # fmt: skip

    def random_places(self, seed: int) -> Iterator[FloatArray]:
        """Yield places in the workspace, many on its border, turned as far as allowed."""
        run = TrialRun(self.rig, np.random.default_rng(seed), self._advance)
        while True:
            yield run.random_place()


@contextmanager
def simulated_rig(
    robot: str,
    *,
    plant: Path | None,
    scanner: bool,
    advance: Callable[[float], None],
    as_calibrated: bool = False,
) -> Iterator[RigOperator]:
    """Open a robot on a simulator of its own; raises what `LockstepRobot` does."""
    with TemporaryDirectory(prefix="cdpr-calibrate-") as folder:
        path = Path(folder) / "scanner.log" if scanner else None
        with LockstepRobot(robot, plant=plant, scanner=path, as_calibrated=as_calibrated) as rig:
            yield RigOperator(rig, None if path is None else ScannerTail(path), advance)
            rig.shut_down()

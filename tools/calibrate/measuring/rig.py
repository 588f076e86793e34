"""A robot on its simulator for the procedure of calibration: scanner beside it, camera on it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.transform import Rotation

from cdpr_profiles.reading.bounded_input import parse_json
from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.markers.sighting import Sighting
from cdpr_rt.core.clock import Clock
from cdpr_rt.core.states import LoopState
from cdpr_rt.errors import TripError
from cdpr_rt.procedures.calibration.measure_poses import (
    NotThePoseError,
    PoseRefusedError,
    Readings,
    TargetNotReached,
)
from cdpr_tools.calibrate.measuring.outside import OutsidePose
from cdpr_tools.calibrate.measuring.ways import (
    StoppedError,
    motion_ended,
    not_reached,
    place_of,
    speed_m_s,
    within_s,
)
from cdpr_tools.errors import WorkFailedError
from cdpr_tools.trials.directions import Directions, platform_of
from cdpr_tools.trials.lockstep import CommandRefusedError, LockstepRobot

if TYPE_CHECKING:
    from cdpr_rt.programs.base import Program
    from cdpr_tools.calibrate.measuring.pose_camera import PoseCamera

_TIGHTEN_S, _BRAKE_S = 180.0, 5.0
_HEADER_BYTES = 1024


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
    """Moves the platform of a simulated robot over its bus; a `PlatformOperator`.

    `stop` is asked whether somebody wants an end, which is told by StoppedError. With `given` what
    the scanner measures is part of a look; else it is read by `outside` alone.
    """

    def __init__(
        self, rig: LockstepRobot, scanner: ScannerTail, given: bool, stop: Callable[[], bool]
    ) -> None:
        self.rig = rig
        self.directions = Directions.of(platform_of(rig.robot))
        self.camera: PoseCamera | None = None
        self.number = 0
        """Of the pose that is read next, counted from 1."""
        self._scanner, self._given, self._stop = scanner, given, stop
        self._standing: int | None = None
        """The scanner's readings when the platform had come to stand; None while it moves."""

    def tighten(self) -> FloatArray:
        """Take up the slack at home; return the place there, (d,)."""
        rig, platform = self.rig, platform_of(self.rig.robot)
        rig.enable()
        rig.program("tighten")
        self._finish(_TIGHTEN_S)
        return np.pad(np.array(platform.home_m), (0, self.directions.d - self.directions.k))

    def move_to(self, place: FloatArray) -> TargetNotReached | None:
        """Take it to a place (d,), or hold it where it is once that takes too long.

        Raises PoseRefusedError, TripError, StoppedError.
        """
        self._standing = None
        rig, directions = self.rig, self.directions
        try:
            rig.program("pose", **directions.arguments(place, speed_m_s(directions)))
        except CommandRefusedError as error:
            if rig.loop.busy or rig.state is not LoopState.ACTIVE:  # it is being ended, or was
                raise NotThePoseError(str(error)) from None
            raise PoseRefusedError(str(error)) from None
        allowed_s = within_s(directions, place_of(rig.progress), place)
        try:
            if self._ended(allowed_s):
                return None
            progress = rig.progress
            rig.program("hold")
            self._ended(_BRAKE_S)
        except WorkFailedError as error:
            raise self._trip(str(error)) from None
        return not_reached(directions, place, place_of(rig.progress), allowed_s, progress)

    def _finish(self, within_s: float) -> None:
        """Run cycles until the program has nothing left to do, or somebody wants an end."""
        if not self._ended(within_s):
            name = self.rig.loop.engine.program.name
            raise WorkFailedError(f"{name}: not within {within_s:g} s: {self.rig.state_text()}")

    def _ended(self, within_s: float) -> bool:
        """Run cycles until the program has nothing left to do; return whether that was in time.

        Raises WorkFailedError where it is ended, StoppedError where somebody wants an end.
        """
        rig, program = self.rig, self.rig.loop.engine.program
        end_s = rig.now_s + within_s

        def over() -> bool:
            ended = rig.loop.engine.program is not program or program.at_rest
            return ended or self._stop() or rig.now_s > end_s

        rig.until(over, within_s + _BRAKE_S, program.name)
        self._heed()
        if rig.loop.engine.program is not program:
            raise WorkFailedError(f"{program.name} was ended: {rig.state_text()}")
        return program.at_rest

    def _heed(self) -> None:
        if self._stop():
            raise StoppedError

    def _trip(self, text: str) -> TripError:
        life = self.rig.loop.life
        return motion_ended(text, life.reason, life.details)

    def wait(self, seconds: float) -> None:
        """Let bus time pass; raises TripError where the motion is ended meanwhile."""
        rig = self.rig
        before = rig.loop.engine.program
        half = round(0.5 * seconds / rig.period_s)
        rig.turn(half)
        if self._standing is None:  # what still moves then is less than a scanner sees
            self._standing = self._scanner.count()
        rig.turn(half)
        self._heed()
        self._require(before)

    def _require(self, program: Program) -> None:
        """Raise TripError where the motion was ended since `program` ran."""
        if self.rig.loop.engine.program is not program:
            raise self._trip(f"the motion was ended: {self.rig.state_text()}")

    def read(self, seconds: float) -> Readings:
        """Let bus time pass and return lengths, tensions, and what the scanner has measured.

        Raises TripError where the motion is ended meanwhile.
        """
        before = self.rig.loop.engine.program
        rows = self.rig.run(seconds)
        self._require(before)
        lengths, tensions = np.array(rows["cable_length_m"]), np.array(rows["tension_N"])
        seen = self._scanned() if self._given else None
        return Readings(lengths, tensions) if seen is None else Readings(lengths, tensions, *seen)

    def _scanned(self) -> tuple[FloatArray, float, FloatArray, float] | None:
        """Return the scanner's means since it stands, each with its deviation."""
        position, rotation = self._scanner.since(self._standing or 0)
        if not len(position):
            return None
        better = math.sqrt(len(position))
        return (
            *(position.mean(axis=0), self._scanner.position_std_m / better),
            *(Rotation.from_matrix(rotation).mean().as_matrix(),),
            self._scanner.rotation_std_rad / better,
        )

    def image(self) -> Sighting | None:
        """Return what the camera sees, None without one; raises what `PoseCamera.see` does."""
        if self.camera is None:
            return None
        return self.camera.see(self.number, self.wait)

    def outside(self) -> OutsidePose:
        """Return what is known of the pose by what the calibration does not use.

        The scanner's readings are all those since the platform stands.
        """
        truth, seen = self.rig.truth(), self._scanned()
        return OutsidePose(
            true_position_m=_tuple(truth["position_m"]),
            true_rotation=_tuples(truth["rotation"]),
            position_m=None if seen is None else _tuple(seen[0]),
            position_std_m=None if seen is None else seen[1],
            rotation=None if seen is None else _tuples(seen[2]),
            rotation_std_rad=None if seen is None else seen[3],
        )


def _tuple(vector: FloatArray) -> tuple[float, ...]:
    return tuple(np.asarray(vector, float).tolist())


def _tuples(matrix: FloatArray) -> tuple[tuple[float, ...], ...]:
    return tuple(_tuple(row) for row in matrix)


@contextmanager
def simulated_rig(
    robot: str,
    *,
    plant: Path | None,
    scanner: bool,
    camera: Callable[[str, Clock], PoseCamera] | None = None,
    stop: Callable[[], bool] = lambda: False,
    as_calibrated: bool = False,
) -> Iterator[RigOperator]:
    """Open a robot on a simulator of its own; raises what `LockstepRobot` does.

    `scanner` has what that measures read as known; `camera` opens the camera of a URL. It is shut
    down under control whatever ends the block, unless the robot does not go on at all.
    """
    with TemporaryDirectory(prefix="cdpr-calibrate-") as folder:
        path, socket = Path(folder) / "scanner.log", Path(folder) / "camera"
        with LockstepRobot(
            robot,
            plant=plant,
            scanner=path,
            camera=None if camera is None else socket,
            as_calibrated=as_calibrated,
            calibration_in_doubt=True,
        ) as rig:
            operator = RigOperator(rig, ScannerTail(path), scanner, stop)
            try:
                if camera is not None:
                    operator.camera = camera(f"sim:{socket}", rig.machine.clock)
                yield operator
            except Exception:
                with suppress(WorkFailedError):  # the first error tells what is wrong
                    rig.shut_down()
                raise
            else:
                rig.shut_down()
            finally:
                if operator.camera is not None:
                    operator.camera.close()

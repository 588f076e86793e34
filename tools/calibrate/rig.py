"""A simulated robot for the calibration procedure, with a scanner beside it and a camera on it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from pydantic import Field
from scipy.spatial.transform import Rotation
from typing_extensions import override

from cdpr_profiles.geometry_calibration import write_text
from cdpr_profiles.reader import Profile, read_json_model
from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.clock import Clock
from cdpr_rt.robot import Error, Robot
from cdpr_tools.calibrate.measure_poses import PoseOperator, Readings, TakeImage, TargetNotReached
from cdpr_tools.client.handle_errors import robot_errors
from cdpr_tools.lockstep_robot import LockstepRobot
from cdpr_tools.recordings.truth import SCANNER, RecordLog

# True and scanned poses of a simulated robot. They only verify a calibration; its fit does not use
# them.

_Vector = tuple[float, ...]
_Matrix = tuple[_Vector, ...]


class OutsidePose(Profile):
    """The true pose in the simulator, and the pose that the scanner measured, if it did."""

    true_position_m: _Vector
    true_rotation: _Matrix
    position_m: _Vector | None = None
    position_std_m: float | None = None
    """Standard deviation of each coordinate."""
    rotation: _Matrix | None = None
    rotation_std_rad: float | None = None
    """Standard deviation about each axis."""

    def with_truth_of(self, other: OutsidePose) -> OutsidePose:
        """Return a copy with the true pose of `other`, from another time."""
        of_other = ("true_position_m", "true_rotation")
        return self.model_copy(update={name: getattr(other, name) for name in of_other})


class OutsidePoses(Profile):
    """True and scanned poses for all poses of a calibration's data, in the same order."""

    poses: tuple[OutsidePose, ...] = Field(max_length=100_000)

    def save(self, path: Path) -> None:
        """Write the file; raises ProfileError."""
        write_text(path, self.model_dump_json() + "\n")

    @classmethod
    def load_file(cls, path: str | Path) -> OutsidePoses:
        """Read such a file; raises ProfileError."""
        return read_json_model(Path(path), cls)


class RigOperator(PoseOperator):
    """Operator of a simulated robot with a scanner.

    If `given`, a reading contains the scanner's pose; otherwise only `outside` returns it.
    """

    def __init__(
        self,
        rig: LockstepRobot,
        scanner: RecordLog,
        given: bool,
        image: TakeImage,
        stop: Callable[[], bool],
    ) -> None:
        super().__init__(Robot(rig), rig.robot, image, stop)
        self.rig = rig
        self._scanner, self._given = scanner, given
        self._standing: int | None = None
        """Number of scanner readings when the platform came to rest; None while it moves."""

    @override
    def move_to(self, place: FloatArray) -> TargetNotReached | None:
        self._standing = None
        return super().move_to(place)

    @override
    def wait(self, seconds: float) -> None:
        super().wait(0.5 * seconds)
        if self._standing is None:  # any motion left is too small for the scanner to see
            self._standing = len(self._scanner)
        super().wait(0.5 * seconds)

    @override
    def read(self, seconds: float) -> Readings:
        readings = super().read(seconds)
        return replace(readings, measured=self._scanned()) if self._given else readings

    def _scanned(self) -> dict[str, Any]:
        """Return the scanner's mean pose since the platform stopped, with standard deviations."""
        rows, header = self._scanner.read(self._standing or 0), self._scanner.header
        if not len(rows):
            return {}
        better = math.sqrt(len(rows))
        return {
            "position_m": _tuple(rows["position_m"].mean(axis=0)),
            "position_std_m": header["position_sigma_m"] / better,
            "rotation": _tuples(Rotation.from_matrix(rows["rotation"]).mean().as_matrix()),
            "rotation_std_rad": header["rotation_sigma_rad"] / better,
        }

    def outside(self) -> OutsidePose:
        """Return the true pose and the scanner's, which the calibration does not use.

        The scanner's pose is the mean of its readings since the platform came to rest.
        """
        truth = self.rig.truth()
        return OutsidePose(
            true_position_m=_tuple(truth["position_m"]),
            true_rotation=_tuples(truth["rotation"]),
            **self._scanned(),
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
    images: Callable[[str, Clock], AbstractContextManager[TakeImage]] | None = None,
    stop: Callable[[], bool] = lambda: False,
    as_calibrated: bool = False,
) -> Iterator[RigOperator]:
    """Open a robot on its own simulator; raises CommandError, DriverError and ProfileError.

    With `scanner`, readings contain the scanner's pose; `images` takes images with the camera of a
    URL. The robot is shut down under control however the block ends, unless it no longer responds.
    """
    with TemporaryDirectory(prefix="cdpr-calibrate-") as folder:
        path, socket = Path(folder) / "scanner.log", Path(folder) / "camera"
        with (
            robot_errors(),
            LockstepRobot(
                robot,
                plant=plant,
                scanner=path,
                camera=None if images is None else socket,
                as_calibrated=as_calibrated,
                calibration_in_doubt=True,
            ) as rig,
            RecordLog(path, SCANNER) as log,
        ):
            camera: AbstractContextManager[TakeImage] = nullcontext(_no_image)
            if images is not None:
                camera = images(f"sim:{socket}", rig.machine.clock)
            try:
                with camera as image:
                    yield RigOperator(rig, log, scanner, image, stop)
            except Exception:
                with suppress(Error):  # the first error shows the cause
                    rig.shut_down()
                raise
            else:
                rig.shut_down()


def _no_image(_wait: Callable[[float], None]) -> None:
    """Take no image, because there is no camera."""

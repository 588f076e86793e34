"""The poses of a calibration, gone to and read on a robot that a daemon runs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from cdpr_drivers.errors import DriverError
from cdpr_profiles import Robot
from cdpr_rt.arrays import FloatArray
from cdpr_rt.errors import ControlError, TripError
from cdpr_rt.procedures.calibration.measure_poses import (
    Measured,
    NotThePoseError,
    PoseRefusedError,
    TargetNotReached,
    measure_poses,
)
from cdpr_tools.calibrate.measuring.daemon_pose import (
    DaemonPoses,
    TakeImage,
    cable_m_per_rad,
    read_into,
)
from cdpr_tools.calibrate.measuring.places import Places
from cdpr_tools.calibrate.measuring.run import StopCriterion
from cdpr_tools.calibrate.measuring.ways import (
    StoppedError,
    motion_ended,
    not_reached,
    speed_m_s,
    within_s,
)
from cdpr_tools.client.client import Daemon, HeldRight, NoDaemonError
from cdpr_tools.client.motion import RENEW_S, ended_text, is_done
from cdpr_tools.client.pose_reader import DaemonReader
from cdpr_tools.client.refusals import DaemonRefusalError
from cdpr_tools.errors import CommandError, WorkFailedError
from cdpr_tools.output import Output
from cdpr_tools.trials.directions import Directions, platform_of

Ask = Callable[[int], None]
"""Takes what a person measures at a pose, counted from 1, at which the platform stands."""


class DaemonOperator(DaemonReader):
    """Moves and reads the platform of a robot that a daemon runs; a `PlatformOperator`.

    The right to move is held while it is `in_control`: nobody else moves the platform then, and
    whatever ends its program, such as a hold from elsewhere, ends that. `stop` is asked whether
    somebody wants an end, which is told by StoppedError.
    """

    def __init__(
        self,
        daemon: Daemon,
        robot: Robot,
        image: TakeImage,
        stop: Callable[[], bool],
    ) -> None:
        super().__init__(daemon, cable_m_per_rad(robot), image)
        self._directions, self._stop = Directions.of(platform_of(robot)), stop
        self._right: HeldRight | None = None
        self._renewed_s = 0.0
        """When the right was renewed last, in bus time."""
        self._program = ""
        """Which one was begun last and still has to run, "" for none."""

    @contextmanager
    def in_control(self) -> Iterator[None]:
        """Hold the right to move in the block, and the platform at its end."""
        try:
            with self._daemon.control() as self._right:
                yield
                self._hold(self._right)
        finally:
            self._right, self._program = None, ""

    def _hold(self, right: HeldRight) -> None:
        self._program = "hold"
        right.hold()

    def move_to(self, place: FloatArray) -> TargetNotReached | None:
        """Take it to a place (d,), or hold it where it is once that takes too long.

        Raises PoseRefusedError, TripError, StoppedError, CommandError for what no pose has a part
        in, such as a daemon whose loop does not answer.
        """
        directions, right = self._directions, self._right
        assert right is not None  # in control
        arguments = directions.arguments(place, speed_m_s(directions))
        try:
            allowed_s = within_s(directions, self.place(), place)
            self._program = ""
            try:
                right.post("/program", {"program": "pose", "wanted": arguments})
            except DaemonRefusalError as error:
                self.status()  # raises where the motion is being ended
                raise PoseRefusedError(str(error)) from None
        except TripError as error:  # before it set out
            raise NotThePoseError(str(error)) from None
        self.wait(RENEW_S)  # what a status tells at once may be of the program before
        self._program = "pose"
        progress = self._until(allowed_s)
        if is_done(progress):
            return None
        self._hold(right)
        return not_reached(directions, place, self.place(), allowed_s, progress)

    def _until(self, seconds: float) -> dict[str, Any]:
        """Return the progress of `pose` once it is done, or so much bus time is over."""
        end_s = self.status()["cycle"]["time_s"] + seconds
        while True:
            status = self.status()
            progress: dict[str, Any] = status["program_progress"]
            if is_done(progress) or status["cycle"]["time_s"] >= end_s:
                return progress
            self.wait(RENEW_S)

    def status(self) -> dict[str, Any]:
        """Return the daemon's status, with the right renewed.

        Raises TripError where the power has gone or is about to, or another program runs.
        """
        if self._stop():
            raise StoppedError
        try:
            status = super().status()
        except NoDaemonError:
            raise
        except WorkFailedError:
            status = self._daemon.get("/status")
            if status["state"] == "active" and _reaction(status) is None:
                raise  # its cables are loose, or nobody knows where it is
            raise self._ended(status) from None
        if _reaction(status) is not None or self._program not in ("", status["program"]):
            raise self._ended(status)
        time_s = status["cycle"]["time_s"]
        if self._right is not None and abs(time_s - self._renewed_s) >= RENEW_S:
            self._right.renew()
            self._renewed_s = time_s
        return status

    def _ended(self, status: dict[str, Any]) -> Exception:
        reaction = _reaction(status)
        how = status["state"] if reaction is None else f"{reaction} under way"
        text = f"the motion was ended: {ended_text(self._daemon, status)} ({how})"
        return motion_ended(text, status["reason"], status["reason_limit"])


def _reaction(status: dict[str, Any]) -> str | None:
    """Return how the robot is being stopped, None where it is not."""
    reaction = str(status.get("reacting", "none"))
    return None if reaction == "none" else reaction


@contextmanager
def going_on(kept: DaemonPoses) -> Iterator[None]:
    """Have what ends the block say how to go on; StoppedError becomes WorkFailedError."""
    try:
        yield
    except StoppedError:
        raise WorkFailedError(f"stopped; {_going_on(kept)}") from None
    except (CommandError, ControlError, DriverError) as error:
        error.add_note(_going_on(kept))
        raise


def read_places(
    out: Output,
    robot: Robot,
    operator: DaemonOperator,
    kept: DaemonPoses,
    places: Places,
    most: int,
    criterion: StopCriterion = lambda _data: None,
    ask: Ask = lambda _pose: None,
) -> None:
    """Read home where there are no poses yet, then places until there are as many as wanted.

    What is read is kept whatever ends it. Raises CommandError, ControlError, DriverError, and
    StoppedError where somebody wants an end.
    """
    with (
        operator.in_control(),
        out.progress(f"reading up to {most} poses", float(most)) as advance,
    ):
        if not kept.data.poses:
            read_into(operator, robot, kept)
            ask(1)

        def keep() -> None:
            kept.add(measured.readings[-1], operator.counted_m)
            advance(float(len(kept.data.poses)))
            ask(len(kept.data.poses))

        before = kept.data
        measured = Measured(keep, list(before.poses), list(before.left_out), list(before.tried))
        done = {reading.target for reading in before.poses} | set(before.tried)
        try:
            for batch in places.batches():
                left = np.array([place for place in batch if tuple(place.tolist()) not in done])
                left = left[: most - len(measured.readings)]
                measure_poses(operator, left, places.middle, measured, out)
                if len(measured.readings) >= most or (len(left) and criterion(kept.data)):
                    return
        finally:
            update = {"left_out": tuple(measured.refused), "tried": tuple(measured.tried)}
            kept.data = kept.data.model_copy(update=update)
            kept.save()
    out.note(f"{len(measured.readings)} poses only: all others were refused")


def _going_on(kept: DaemonPoses) -> str:
    if not kept.data.poses:
        return "nothing was read yet"
    count = len(kept.data.poses)
    are = "1 pose is" if count == 1 else f"{count} poses are"
    return f"{are} kept in {kept.folder}; the same command goes on behind"

"""What trials do with a robot: start it up, send it places, and mark in the recording when."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_rt.exchange import FloatArray
from profiles import Robot, load_robot
from profiles.platform import Platform
from tools.errors import BadInputError, WorkFailedError
from tools.robots.statics import can_be_computed
from tools.trials.lockstep import LockstepRobot, OrderRefusedError
from tools.trials.recorded import TRUTH

_TIGHTEN_S, _MOVE_S = 180.0, 60.0
_SETTLE_S = 2.0
_TRIES = 100
_CORNER_SHARE = 0.3


class TrialRun:
    """A robot under trial whose platform is held, in the middle of its workspace.

    `chance` decides, `advance` is told the bus time that has passed.
    """

    def __init__(
        self, rig: LockstepRobot, chance: np.random.Generator, advance: Callable[[float], None]
    ) -> None:
        self.rig = rig
        self.platform = platform_of(rig.robot)
        self.low_m = np.array(self.platform.workspace_min_m)
        self.high_m = np.array(self.platform.workspace_max_m)
        self.chance = chance
        self.refused = 0
        """Places that the robot has refused, with its reason."""
        self._advance = advance
        self._begun_s = rig.now_s

    @property
    def elapsed_s(self) -> float:
        """Bus time since the trial began."""
        return self.rig.now_s - self._begun_s

    def start_up(self) -> None:
        """Tighten the cables, go to the middle of the workspace and stay for a moment."""
        rig = self.rig
        rig.enable()
        rig.carry_out("tighten", _TIGHTEN_S)
        self.go(0.5 * (self.low_m + self.high_m))
        self.stay(_SETTLE_S)
        self._begun_s = rig.now_s

    def mark(self, what: str, **values: Any) -> None:
        """Write down among the recording's events what happens in this cycle."""
        recorder = self.rig.recorder
        assert recorder is not None  # trials are recorded
        recorder.remark(f"trial: {what}", mark=what, cycle=self.rig.cycle, **values)

    def anywhere(self) -> FloatArray:
        """Return a place of the workspace, (2,): any, in part on its border or in its corners."""
        place = self.chance.uniform(self.low_m, self.high_m)
        edge = self.chance.random(2) < _CORNER_SHARE
        ends = np.where(self.chance.random(2) < 0.5, self.low_m, self.high_m)
        return np.asarray(np.where(edge, ends, place))

    def head_for(self, position_m: FloatArray, **wanted: Any) -> None:
        """Have the platform go to a place; returns at once. Raises OrderRefusedError."""
        self.rig.program("pose", position_m=position_m.tolist(), **wanted)
        self._advance(self.elapsed_s)

    def head_anywhere(self) -> FloatArray:
        """Have the platform go to some place that the robot does not refuse; return it, (2,)."""
        for _ in range(_TRIES):
            place = self.anywhere()
            try:
                self.head_for(place)
            except OrderRefusedError as error:
                self.refused += 1
                reason = str(error)
                self.mark("refused", target_m=place.tolist(), reason=reason)
                continue
            return place
        raise WorkFailedError(f"{_TRIES} places in the workspace were refused, the last: {reason}")

    def go(self, position_m: FloatArray, **wanted: Any) -> None:
        """Take the platform to a place; its set-point stands there then."""
        self.head_for(position_m, **wanted)
        self.rig.finish(_MOVE_S + self._time_s(position_m, wanted.get("speed_m_s")))

    def arrive(self) -> None:
        """Wait until the set-point stands at its target."""
        self.rig.finish(_MOVE_S)

    def stay(self, seconds: float) -> None:
        """Run cycles; raises WorkFailedError where the motion is ended meanwhile."""
        self.rig.turn(round(seconds / self.rig.period_s))
        if self.rig.loop.program.name != "pose":
            raise WorkFailedError(f"the motion was ended: {self.rig.told()}")
        self._advance(self.elapsed_s)

    def _time_s(self, position_m: FloatArray, speed_m_s: float | None) -> float:
        way = float(np.abs(position_m - self.rig.truth()["position_m"][:2]).max())
        return way / (speed_m_s or self.platform.speed_m_s)


def platform_of(robot: Robot) -> Platform:
    """Return a robot's platform; raises BadInputError for a robot whose platform is not moved."""
    platform = robot.platform
    if platform is None or not can_be_computed(robot):
        raise BadInputError(
            f"{robot.path}: has no platform in a plane on three cables; allowed: [platform] of two "
            "coordinates and three axes, such as planar-3 has"
        )
    return platform


@contextmanager
def trial_run(
    robot: str,
    folder: Path,
    *,
    plant: Path | None,
    seed: int,
    advance: Callable[[float], None],
    **options: Any,
) -> Iterator[TrialRun]:
    """Open a robot, start it up, and record the block in `folder` with what was true.

    The block is all that counts: it stands between the marks `begin` and `end`.
    """
    platform_of(load_robot(robot))
    _require_empty(folder)
    with LockstepRobot(
        robot, plant=plant, record=folder, truth_log=folder / TRUTH, **options
    ) as rig:
        run = TrialRun(rig, np.random.default_rng(seed), advance)
        run.start_up()
        run.mark("begin", sync_offset=rig.sync_offset, robot=robot, seed=seed)
        yield run
        run.mark("end", refused=run.refused)
        rig.turn()  # the last cycle is in the recording as well
    recorder = rig.recorder
    if recorder is not None and (told := recorder.told())["error"]:
        raise WorkFailedError(str(told["error"]))


def _require_empty(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        used = [path.name for path in folder.iterdir()]
    except OSError as error:
        raise BadInputError(f"{folder}: {error.strerror}") from error
    if used:
        raise BadInputError(f"{folder}: not empty ({used[0]}); allowed: a new or empty folder")

"""Start a robot under trial, move it to places, and write marks into its recording."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_profiles import load_robot
from cdpr_rt.arrays import FloatArray
from cdpr_rt.robot import Error, Refused
from cdpr_tools.client.handle_errors import robot_errors
from cdpr_tools.errors import BadInputError, WorkFailedError
from cdpr_tools.lockstep_robot import LockstepRobot
from cdpr_tools.trials.directions import Directions, platform_of
from cdpr_tools.trials.recorded import TRUTH

_TIGHTEN_S, _MOVE_S = 180.0, 60.0
_SETTLE_S = 2.0
_TRIES = 100
_CORNER_SHARE = 0.3
_BORDER = 1.0 - 1e-9
"""Share of the largest angle that is used; rounding might make the full angle too large."""


class TrialRun:
    """A robot under trial; `start_up` tightens it and moves it to the middle of its workspace.

    `rng` makes all random choices; `advance` receives the elapsed bus time.
    """

    def __init__(
        self, rig: LockstepRobot, rng: np.random.Generator, advance: Callable[[float], None]
    ) -> None:
        self.rig = rig
        self.directions = Directions.of(platform_of(rig.robot))
        self.rng = rng
        self.refused = 0
        """Number of random places that the robot has refused."""
        self._advance = advance
        self._begun_s = math.inf

    @property
    def elapsed_s(self) -> float:
        """Bus time since the trial began, 0 while the robot starts up."""
        return max(0.0, self.rig.now_s - self._begun_s)

    def start_up(self) -> None:
        """Tighten the cables, go to the middle of the workspace and stay for a moment."""
        rig = self.rig
        rig.enable()
        rig.carry_out("tighten", _TIGHTEN_S)
        self.go(self.directions.middle)
        self.stay(_SETTLE_S)
        self._begun_s = rig.now_s

    def mark(self, what: str, **values: Any) -> None:
        """Write an event of this cycle into the recording."""
        recorder = self.rig.recorder
        assert recorder is not None  # all trials are recorded
        recorder.remark(f"trial: {what}", mark=what, cycle=self.rig.cycle, **values)

    def random_place(self) -> FloatArray:
        """Return a random place of the workspace, (d,), sometimes on its border or in a corner.

        Angles are about a random axis, and sometimes as large as allowed.
        """
        low, high = self.directions.low_m, self.directions.high_m
        rng, k = self.rng, self.directions.k
        place = rng.uniform(low, high)
        edge = rng.random(k) < _CORNER_SHARE
        ends = np.where(rng.random(k) < 0.5, low, high)
        return np.append(np.where(edge, ends, place), self._random_turn())

    def _random_turn(self) -> FloatArray:
        turns, rng = len(self.directions.turns), self.rng
        if not turns or not self.directions.angle_rad:
            return np.zeros(turns)
        axis = rng.standard_normal(turns)
        share = rng.random() ** (1.0 / turns)
        if rng.random() < _CORNER_SHARE:
            share = _BORDER
        return np.asarray(share * self.directions.angle_rad * axis / np.linalg.norm(axis))

    def start_move(self, place: FloatArray, speed_m_s: float | None = None) -> None:
        """Start a move to a place (d,); returns immediately. Raises Refused."""
        self.rig.program("pose", **self.directions.arguments(place, speed_m_s))
        self._advance(self.elapsed_s)

    def start_random_move(self, speed_m_s: float | None = None) -> FloatArray:
        """Start a move to a random place that the robot accepts; return it, (d,)."""
        for _ in range(_TRIES):
            place = self.random_place()
            try:
                self.start_move(place, speed_m_s)
            except Refused as error:
                self.refused += 1
                reason = str(error)
                self.mark("refused", **self.directions.marked(place, "target"), reason=reason)
                continue
            return place
        raise WorkFailedError(
            f"{_TRIES} targets in the workspace were rejected, the last: {reason}"
        )

    def go(self, place: FloatArray, speed_m_s: float | None = None) -> None:
        """Move to a place (d,) and wait until the set-point stands there."""
        self.start_move(place, speed_m_s)
        self.arrive(self._time_s(place, speed_m_s))

    def arrive(self, longer_s: float = 0.0) -> None:
        """Wait until the set-point stands at its target."""
        self.rig.finish(_MOVE_S + longer_s)

    def stay(self, seconds: float) -> None:
        """Run cycles; raises WorkFailedError if the motion ends meanwhile."""
        self.rig.turn(round(seconds / self.rig.period_s))
        if self.rig.loop.engine.program.name != "pose":
            raise WorkFailedError(f"the motion was ended: {self.rig.state_text()}")
        self._advance(self.elapsed_s)

    def _time_s(self, place: FloatArray, speed_m_s: float | None) -> float:
        """Return the least time to reach a place, from its slowest direction."""
        directions, truth = self.directions, self.rig.truth()
        place_now = directions.places(truth["position_m"][None], truth["rotation"][None])[0]
        share = 1.0 if speed_m_s is None else speed_m_s / directions.speed[0]
        return float((np.abs(place - place_now) / (share * directions.speed)).max())


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
    """Open a robot, start it up, and record the block in `folder`, with the truth.

    Only the block is judged: it lies between the marks `begin` and `end`.
    """
    platform_of(load_robot(robot))
    _require_empty(folder)
    with (
        robot_errors(),
        LockstepRobot(
            robot, plant=plant, record=folder, truth_log=folder / TRUTH, **options
        ) as rig,
    ):
        run = TrialRun(rig, np.random.default_rng(seed), advance)
        with _with_notices(rig):
            run.start_up()
        home_rad = platform_of(rig.robot).home_rotation_rad
        known = rig.robot.calibration
        run.mark(
            "begin", sync_offset=rig.machine.sync_offset, robot=robot, seed=seed,
            home_rotation_rad=home_rad, calibration=None if known is None else known.summary(),
        )  # fmt: skip
        with _with_notices(rig):
            yield run
        run.mark("end", refused=run.refused, notices=rig.status()["notices"])
        rig.turn()  # so that the recording contains the last cycle
    recorder = rig.recorder
    if recorder is not None and (status := recorder.status())["error"]:
        raise WorkFailedError(str(status["error"]))


@contextmanager
def _with_notices(rig: LockstepRobot) -> Iterator[None]:
    """Add the notices of the robot's status to an error of the block."""
    try:
        yield
    except (Error, WorkFailedError) as error:
        for text in rig.status()["notices"]:
            error.add_note(text)
        raise


def _require_empty(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        used = [path.name for path in folder.iterdir()]
    except OSError as error:
        raise BadInputError(f"{folder}: {error.strerror}") from error
    if used:
        raise BadInputError(f"{folder}: not empty ({used[0]}); allowed: a new or empty folder")

"""`cdpr_rt.simulate`: a robot on simulated drives, run in lockstep in this process."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Any, Final

from cdpr_drivers.errors import DriverError
from cdpr_profiles.errors import ProfileError
from cdpr_rt.core.cycle_row import Row
from cdpr_rt.errors import ControlError
from cdpr_rt.platform.own_controller import Controller
from cdpr_rt.robot import Error, InvalidArgument, InvalidRobot, NotRunning, Refused, Robot
from cdpr_tools.composition.fault_injection import injection_of
from cdpr_tools.errors import BadInputError, CommandError
from cdpr_tools.trials.lockstep import CommandRefusedError, LockstepRobot

_LOG_S: Final = 300.0
_REPLY_S: Final = 120.0


def simulate(
    robot: str | Path, *, plant: str | Path | None = None, controller: Controller | None = None
) -> Robot:
    """Return a robot on simulated drives in this process, ready and without power.

    `robot` is the name or file of a robot, `plant` a file with the deviations of the simulated
    machine from it. `controller` replaces the built-in controller of the platform. Bus time passes
    only while a method waits, as fast as this machine computes: the same script gives the same
    rows. Use the handle from one thread. Closing it removes the power. Raises InvalidRobot, and
    Error if the drives do not get ready.
    """
    plant_file = None if plant is None else Path(plant)
    try:
        made = LockstepRobot(
            robot, plant=plant_file, controller=controller, ring_s=_LOG_S, pinned=False
        )
        if controller is not None and made.robot.platform is None:
            raise InvalidArgument(f"controller: {robot} has no platform to control")
        opened = made.__enter__()
    except (ProfileError, BadInputError) as error:
        raise InvalidRobot(str(error)) from error
    except (CommandError, DriverError, ControlError) as error:
        raise Error(str(error)) from error
    return handle_of(opened)


def handle_of(robot: LockstepRobot) -> Robot:
    """Return a handle of an open robot."""
    return Robot(_InProcess(robot))


class _InProcess:
    """Backend on a `LockstepRobot`. A Ctrl-C takes effect between two cycles."""

    look_s = 0.02

    def __init__(self, robot: LockstepRobot) -> None:
        self._robot: LockstepRobot | None = robot
        self.description: Mapping[str, Any] = robot.description
        self._began = robot.rows_written

    @property
    def _open(self) -> LockstepRobot:
        if self._robot is None:
            raise NotRunning("the simulation has ended")
        return self._robot

    def command(self, do: str, program: str = "", wanted: Mapping[str, Any] | None = None) -> None:
        fields = {"program": program} if program else {}
        with _errors(), _interrupts_deferred():
            self._open.command(do, _REPLY_S, **fields, wanted=dict(wanted or {}))

    def status(self) -> dict[str, Any]:
        return self._open.status

    def wait(self, seconds: float) -> None:
        robot = self._open
        with _errors(), _interrupts_deferred():
            robot.turn(max(1, round(seconds / robot.period_s)))

    def observe(self, seconds: float) -> Row:
        began = self._open.rows_written
        self.wait(seconds)
        return self._open.kept_rows(began)

    def plan(self, file: Path) -> str:
        # imported here: most scripts follow no path
        from cdpr_rt.programs.path_store import write_plan  # noqa: PLC0415
        from cdpr_tools.paths.options import PathOptions  # noqa: PLC0415
        from cdpr_tools.paths.preview import obstacle_text, preview  # noqa: PLC0415

        robot = self._open
        try:
            shown = preview(robot.robot, file, PathOptions(), lambda _what, _part: None)
        except (ProfileError, ControlError, BadInputError) as error:
            raise Refused(str(error)) from None
        plan, paths = shown.plan, robot.loop.engine.parts.paths
        if shown.obstacle is not None or plan.timed is None or paths is None:
            raise Refused(obstacle_text(shown))
        if plan.next_line is not None:
            raise Refused(f"{file}: is too long for one plan; divide it at line {plan.next_line}")
        folder = robot.folder / "paths"
        paths.open(folder)
        lines = plan.nodes.line[plan.timed.node]
        return write_plan(folder, plan.timed, lines, file.name, shown.planner.model)

    def log(self, fields: Sequence[str]) -> Row:
        return self._open.kept_rows(self._began)[list(fields)]

    def inject_fault(self, axis: int, fault: str, value: int | None) -> None:
        with _errors(), _interrupts_deferred():
            self._open.inject_fault(axis, *injection_of(fault, value))

    def end(self) -> None:
        with _errors(), _interrupts_deferred():
            self._open.shut_down()

    def close(self) -> None:
        robot, self._robot = self._robot, None
        if robot is not None:
            with _errors(), _interrupts_deferred():
                robot.__exit__(None, None, None)


@contextmanager
def _interrupts_deferred() -> Iterator[None]:
    """Defer a Ctrl-C in the block to its end; a second one raises KeyboardInterrupt immediately."""
    if (
        threading.current_thread() is not threading.main_thread()
        or signal.getsignal(signal.SIGINT) is not signal.default_int_handler
    ):
        yield
        return
    interrupts = 0

    def note(_number: int, _frame: FrameType | None) -> None:
        nonlocal interrupts
        interrupts += 1
        if interrupts > 1:
            raise KeyboardInterrupt

    signal.signal(signal.SIGINT, note)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        if interrupts == 1:
            raise KeyboardInterrupt


@contextmanager
def _errors() -> Iterator[None]:
    try:
        yield
    except CommandRefusedError as error:
        refusal = error.refusal
        text = str(refusal) if refusal else str(error).partition(": ")[2]
        raise Refused(text, refusal) from error
    except BadInputError as error:
        raise InvalidArgument(str(error)) from error
    except (CommandError, DriverError, ControlError) as error:
        raise Error(str(error)) from error

"""A simulator that belongs to a command: a separate process that ends with the command."""

from __future__ import annotations

import json
import os
import select
import subprocess
import sys
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from itertools import count
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import IO, TYPE_CHECKING, Any

from typing_extensions import override

from cdpr_tools.compiling import NOTICE
from cdpr_tools.errors import BadInputError, WorkFailedError
from cdpr_tools.processes import end_by_stdin, module_command

if TYPE_CHECKING:
    from cdpr_profiles.robot import Robot
    from cdpr_tools.composition.fault_injection import SimulatorChannel

# if the physics was not compiled at installation, the first start compiles it for some minutes
_START_TIMEOUT_S = 600.0
# a process that is only delayed still completes its logs
_STOP_TIMEOUT_S = 60.0

_numbers, _trials = count(1), count()


class _OwnProcess:
    """A command of this package that ends when its standard input closes, even if we die."""

    def __init__(
        self, *command: str, meanwhile: Callable[[], None] | None = None, waits: bool = True
    ) -> None:
        """Start the command and, if it `waits`, wait until it is ready, see `await_ready`.

        `meanwhile` is called while it starts.
        """
        self.process = subprocess.Popen(
            module_command("cdpr_tools.cli", *command, "--exit-with-stdin"),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            start_new_session=True,  # a Ctrl-C at the terminal is handled here, not there
        )
        try:
            if meanwhile is not None:
                meanwhile()
            if waits:
                self.ready = self.await_ready()
        except BaseException:
            self.stop()
            raise

    def await_ready(self) -> str:
        """Wait for the line of JSON with `ready` that the process prints, and return it.

        If the process ends instead, raises the error that its exit status stands for:
        BadInputError or WorkFailedError.
        """
        out, errors = self._pipe(self.process.stdout), self._pipe(self.process.stderr)
        deadline, output = time.monotonic() + _START_TIMEOUT_S, ""
        heard = [out, errors]
        while time.monotonic() < deadline:
            ready, _, _ = select.select(heard, [], [], 0.1)
            if errors in ready:
                if not (text := os.read(errors.fileno(), 4096).decode(errors="replace")):
                    heard = [out]
                output += text
                if text.startswith(NOTICE):
                    print(text, end="", file=sys.stderr, flush=True)
            if out in ready:
                if ready_line := os.read(out.fileno(), 4096):
                    return ready_line.decode()
                break
        if self.process.poll() is None and time.monotonic() >= deadline:
            raise WorkFailedError(f"the simulator was not ready within {_START_TIMEOUT_S:g} s")
        output += errors.read().decode(errors="replace")
        message = "\n".join(x for x in output.splitlines() if not x.startswith(NOTICE))
        kind = (
            BadInputError if self.process.wait() == BadInputError.exit_status else WorkFailedError
        )
        message = message.strip().removeprefix("cdpr: ")
        raise kind(message or "the simulator ended before it was ready")

    @staticmethod
    def _pipe(pipe: IO[bytes] | None) -> IO[bytes]:
        assert pipe is not None  # opened with PIPE
        return pipe

    @property
    def lifeline(self) -> int:
        """Descriptor that keeps the simulator alive while it is open, here or in a child."""
        return self._pipe(self.process.stdin).fileno()

    def stop(self) -> None:
        """End the process; its logs are complete afterwards."""
        end_by_stdin(self.process, _STOP_TIMEOUT_S)


class OwnLoadCells(_OwnProcess):
    """A running `cdpr sim tension`, on the cables of the physics board of a simulator."""

    def __init__(self, sensors: str, board: Path) -> None:
        super().__init__("sim", "tension", sensors, "--board", str(board))
        self.port = str(json.loads(self.ready)["ready"]["port"])
        """Path of the serial line."""


class OwnSimulator(_OwnProcess):
    """A running `cdpr sim up`.

    If the environment has CDPR_SIM_FRAME_LOG=FILE, the simulator logs all frames to FILE. Further
    simulators of this process append -2, -3 and so on to the name of FILE.
    """

    def __init__(
        self,
        winch: str,
        bus: str,
        plant: Path | None = None,
        truth_log: Path | None = None,
        nodes: int = 1,
        board: Path | None = None,
        paced: bool = False,
        detached: bool = False,
        scanner: Path | None = None,
        camera: Path | None = None,
        meanwhile: Callable[[], None] | None = None,
        waits: bool = True,
    ) -> None:
        command = ["sim", "up", winch, "--bus", bus, "--paced" if paced else "--lockstep"]
        command += ["--nodes", str(nodes)]
        if detached:
            command.append("--detached")
        log = os.environ.get("CDPR_SIM_FRAME_LOG")
        for option, path in (
            ("--plant", plant),
            ("--truth-log", truth_log),
            ("--scanner", scanner),
            ("--board", board),
            ("--camera", camera),
            ("--frame-log", _numbered(Path(log), next(_numbers)) if log else None),
        ):
            if path is not None:
                command += [option, str(path)]
        self.bus = bus
        super().__init__(*command, meanwhile=meanwhile, waits=waits)


class RobotSimulator(ABC):
    """A simulator of one robot in lockstep, and the folder for its files."""

    local: bool
    """Whether it runs in this process."""
    bus: str
    folder: Path
    """Folder for temporary files, removed at the end."""
    truth_log: Path
    """The log of the true motion."""
    board: Path | None

    @abstractmethod
    def await_ready(self) -> str:
        """Wait until it is ready."""

    @abstractmethod
    def stop(self) -> None:
        """End the simulator, and remove its folder."""

    @abstractmethod
    def _ask(self, key: str, value: Any = True) -> Any:
        """Return the answer to a request beside the buses; raises BadInputError."""

    def inject(
        self,
        fault: str,
        axis: int | None = None,
        value: float | None = None,
        at_s: float | None = None,
    ) -> dict[str, Any]:
        """Inject a fault at bus time `at_s`, by default now; return the order with its values.

        `cdpr_sim_bus.cia402.faults` lists the faults; "mend" ends those of an axis, or all. Axes
        count from 1. The value 0 mends only this fault. Bus time is `truth()["time_s"]`, and the
        time of a clock that leads the bus. Raises BadInputError for an invalid order.
        """
        order = {"fault": fault, "axis": axis, "value": value, "at_s": at_s}
        return dict(self._ask("fault", order))

    def broken(self) -> list[dict[str, Any]]:
        """Return what is broken now: `fault`, `axis`, `value`."""
        return list(self._ask("broken"))

    def truth(self) -> dict[str, Any]:
        """Return the truth now, for a judge: `time_s`, `drives`, `platform`, `faults`.

        It needs no running loop. Each of `faults` has `fault`, `axis`, `value`, `at_s`, `ended_s`.
        """
        return dict(self._ask("truth"))


class LockstepSimulator(OwnSimulator, RobotSimulator):
    """A simulator of `robot` in lockstep, on a separate bus, with a folder for its files.

    The process has started, but it is ready only after `await_ready`. `reference` is the name or
    file of the robot. The true pose of a platform is logged to `truth_log`, by default to a file in
    the folder.
    """

    local = False

    def __init__(
        self,
        robot: Robot,
        reference: str,
        plant: Path | None,
        truth_log: Path | None = None,
        scanner: Path | None = None,
        camera: Path | None = None,
    ) -> None:
        self._channel: SimulatorChannel | None = None
        self._temporary = TemporaryDirectory(prefix="cdpr-trial-")
        self.folder = Path(self._temporary.name)
        self.truth_log: Path = truth_log or self.folder / "truth.log"
        self._robot = robot
        self.board = None if robot.tension_sensors is None else self.folder / "board"
        super().__init__(
            *(reference, f"simbus:trial-{os.getpid()}-{next(_trials)}", plant, self.truth_log),
            board=self.board,
            scanner=scanner,
            camera=camera,
            waits=False,
        )

    @override
    def _ask(self, key: str, value: Any = True) -> Any:
        if self._channel is None:
            # imported here: the buses load slowly, and a simulator must start before that
            from cdpr_drivers.robot.robot_buses import robot_urls  # noqa: PLC0415
            from cdpr_tools.composition.fault_injection import SimulatorChannel  # noqa: PLC0415

            url = next(iter(robot_urls(self._robot, [self.bus]).values()))
            self._channel = SimulatorChannel(url)
        return self._channel.ask(key, value)

    @override
    def stop(self) -> None:
        """End the simulator, and remove its folder."""
        if self._channel is not None:
            self._channel.close()
        super().stop()
        self._temporary.cleanup()


class OwnCamera(_OwnProcess):
    """A running `cdpr sim camera`, on the platform of a physics board."""

    def __init__(self, socket: Path, board: Path, plant: Path | None) -> None:
        more = () if plant is None else ("--plant", str(plant))
        super().__init__("sim", "camera", str(socket), "--board", str(board), *more)


def _numbered(path: Path, number: int) -> Path:
    return path if number == 1 else path.with_stem(f"{path.stem}-{number}")

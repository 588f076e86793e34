"""A simulator that belongs to a command: a separate process that ends with the command."""

from __future__ import annotations

import json
import os
import select
import subprocess
import sys
import time
from collections.abc import Callable
from itertools import count
from pathlib import Path
from typing import IO

from cdpr_tools.compiling import NOTICE
from cdpr_tools.errors import BadInputError, WorkFailedError
from cdpr_tools.processes import end_by_stdin, module_command

# if the physics was not compiled at installation, the first start compiles it for some minutes
_START_TIMEOUT_S = 600.0
# a process that is only delayed still completes its logs
_STOP_TIMEOUT_S = 60.0

_numbers = count(1)


class _OwnProcess:
    """A command of this package that ends when its standard input closes, even if we die."""

    def __init__(self, *command: str, meanwhile: Callable[[], None] | None = None) -> None:
        """Start the command, call `meanwhile`, and wait until it is ready.

        If the process ends instead, raises the error that its exit status stands for:
        BadInputError or WorkFailedError.
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
            self.ready = self._await_ready()
        except BaseException:
            self.stop()
            raise

    def _await_ready(self) -> str:
        """Wait for the line of JSON with `ready` that the process prints, and return it."""
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
        paced: bool = False,
        camera: Path | None = None,
        meanwhile: Callable[[], None] | None = None,
    ) -> None:
        command = ["sim", "up", winch, "--bus", bus, "--paced" if paced else "--lockstep"]
        command += ["--nodes", str(nodes)]
        for option, path in (
            ("--plant", plant),
            ("--truth-log", truth_log),
            ("--camera", camera),
            ("--frame-log", next_frame_log()),
        ):
            if path is not None:
                command += [option, str(path)]
        self.bus = bus
        super().__init__(*command, meanwhile=meanwhile)


class OwnCamera(_OwnProcess):
    """A running `cdpr sim camera`, on the platform of a physics board."""

    def __init__(self, socket: Path, board: Path, plant: Path | None) -> None:
        more = () if plant is None else ("--plant", str(plant))
        super().__init__("sim", "camera", str(socket), "--board", str(board), *more)


def next_frame_log() -> Path | None:
    """Return the file for the frames of the next simulator of this process; None without one."""
    log = os.environ.get("CDPR_SIM_FRAME_LOG")
    if not log:
        return None
    path, number = Path(log), next(_numbers)
    return path if number == 1 else path.with_stem(f"{path.stem}-{number}")

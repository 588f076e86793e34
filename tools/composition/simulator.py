"""A simulator that belongs to a command: its own process, ended with the command."""

from __future__ import annotations

import contextlib
import os
import select
import subprocess
import sys
import time
from itertools import count
from pathlib import Path
from typing import IO

from cdpr_tools.errors import BadInputError, WorkFailedError

# the first start on a machine compiles the physics
_START_TIMEOUT_S = 180.0
# one that is only held up completes its logs
_STOP_TIMEOUT_S = 60.0

_numbers = count(1)


class OwnSimulator:
    """A running `cdpr sim up`; leaves when its standard input closes, so also when we die.

    Where the environment has CDPR_SIM_FRAME_LOG=FILE, it logs all frames there, those of further
    simulators of this process in FILE with -2, -3 and so on at the end of its name.
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
    ) -> None:
        command = [sys.executable, "-P", "-m", "cdpr_tools.cli", "sim", "up", winch, "--bus", bus]
        command += ["--paced" if paced else "--lockstep", "--exit-with-stdin"]
        command += ["--nodes", str(nodes)]
        if detached:
            command.append("--detached")
        if plant is not None:
            command += ["--plant", str(plant)]
        if truth_log is not None:
            command += ["--truth-log", str(truth_log)]
        if scanner is not None:
            command += ["--scanner", str(scanner)]
        if board is not None:
            command += ["--board", str(board)]
        if log := os.environ.get("CDPR_SIM_FRAME_LOG"):
            command += ["--frame-log", str(_numbered(Path(log), next(_numbers)))]
        self.bus = bus
        self.process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            start_new_session=True,  # a Ctrl-C at the terminal is ours to handle, not its
        )
        try:
            self._await_ready()
        except BaseException:
            self.stop()
            raise

    def _await_ready(self) -> None:
        out = self._pipe(self.process.stdout)
        deadline = time.monotonic() + _START_TIMEOUT_S
        while time.monotonic() < deadline:
            ready, _, _ = select.select([out], [], [], 0.1)
            if ready:
                if os.read(out.fileno(), 4096):
                    return
                break
        errors = self._pipe(self.process.stderr)
        if self.process.poll() is None and time.monotonic() >= deadline:
            raise WorkFailedError(f"the simulator was not ready within {_START_TIMEOUT_S:g} s")
        message = errors.read().decode(errors="replace").strip().removeprefix("cdpr: ")
        kind = (
            BadInputError if self.process.wait() == BadInputError.exit_status else WorkFailedError
        )
        raise kind(message or "the simulator ended before it was ready")

    @staticmethod
    def _pipe(pipe: IO[bytes] | None) -> IO[bytes]:
        assert pipe is not None  # opened with PIPE
        return pipe

    @property
    def lifeline(self) -> int:
        """Descriptor as long as which is open, here or in a child, the simulator stays."""
        return self._pipe(self.process.stdin).fileno()

    def stop(self) -> None:
        """End the simulator; what it logs is complete afterwards."""
        with contextlib.suppress(OSError):
            self._pipe(self.process.stdin).close()
        try:
            self.process.wait(_STOP_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        for pipe in (self.process.stdout, self.process.stderr):
            self._pipe(pipe).close()


def _numbered(path: Path, number: int) -> Path:
    return path if number == 1 else path.with_stem(f"{path.stem}-{number}")

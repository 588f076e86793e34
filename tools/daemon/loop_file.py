"""The files that name a daemon's loop and its launcher, beside the daemon's socket.

The loop's file names the process that a signal makes cut the power. The launcher writes the file
once the loop obeys `POWER_OFF_SIGNAL`. The launcher's file is also the robot's lock. Its content is
trusted only for processes of its owner, because the reader may be root.
"""

from __future__ import annotations

import fcntl
import os
import select
import signal
import stat
import time
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Final, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError

from cdpr_profiles.bounded_input import open_regular, parse_json, replacing
from cdpr_profiles.errors import ProfileError, brief
from cdpr_rt.loop.stop_socket import STOP_SUFFIX
from cdpr_rt.state_file import FILE_MODE
from cdpr_tools.command_group import ROBOT_VARIABLE
from cdpr_tools.daemon.paths import (
    LAUNCHER_SUFFIX,
    LOOP_SUFFIX,
    find_loop_files,
    is_file_of,
    is_trusted,
    short_name,
)
from cdpr_tools.errors import BadInputError, WorkFailedError, os_error_as

POWER_OFF_SIGNAL: Final = signal.SIGUSR1
"""Makes a loop remove torque and power from its drives immediately and latch a fault."""
_MOST_BYTES = 16384
_MOST_PID = 1 << 22
_MOST_FD = 1 << 20


class LoopFile(BaseModel):
    """The process that runs a robot's loop, and its shared memory."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    robot: Annotated[str, AfterValidator(brief)]
    reference: str = ""
    """How the robot was loaded: a name, or the path of its file."""
    uid: int = Field(ge=0)
    """User id of the process, who also owns the file."""
    pid: int = Field(gt=1, le=_MOST_PID)
    started: int = Field(ge=0)
    """Start time in clock ticks since boot; with the pid it identifies one process."""
    block_fd: int = Field(ge=0, le=_MOST_FD)
    """The descriptor of the shared memory, in that process."""
    drives_stop_s: float = Field(ge=0.0, allow_inf_nan=False)
    """Time within which the drives stop after the loop falls silent."""

    @staticmethod
    def beside(socket: Path) -> Path:
        """Return the path of the file for the daemon with this socket."""
        return socket.with_suffix(LOOP_SUFFIX)

    def write(self, path: Path) -> None:
        """Write the file, for this user only, completely or not at all. Raises OSError."""
        with replacing(path, FILE_MODE) as file:
            file.write(self.model_dump_json().encode())

    def remove(self, path: Path) -> None:
        """Remove the file, and the socket left by a killed loop, unless they are another's."""
        with suppress(WorkFailedError, OSError):
            if LoopFile.read(path) == self:
                path.unlink()
                path.with_suffix(STOP_SUFFIX).unlink(missing_ok=True)

    @classmethod
    def read(cls, path: Path) -> LoopFile:
        """Return the content of the file; raises WorkFailedError, also if it is another user's."""
        try:
            with os.fdopen(open_regular(path, links=False), "rb") as file:
                owner = os.fstat(file.fileno()).st_uid
                data = file.read(_MOST_BYTES)
            if not is_trusted(path, owner):
                raise WorkFailedError(
                    f"{path}: belongs to user {owner} and is ignored; remove it, or choose another "
                    "--socket"
                )
            found = cls.model_validate(parse_json(data, path))
        except ProfileError as error:
            raise WorkFailedError(str(error)) from None
        except OSError as error:
            raise WorkFailedError(f"{path}: cannot be read: {error.strerror}") from None
        except ValidationError as error:
            what = error.errors()[0]["msg"]
            raise WorkFailedError(f"{path}: does not name a loop: {what}") from None
        if found.uid != owner:
            raise WorkFailedError(f"{path}: does not name a loop: it belongs to user {owner}")
        return found

    def open(self) -> int | None:
        """Return a pidfd of the process; None if it has ended or its loop has run its last turn.

        Raises WorkFailedError if it is another user's, or `POWER_OFF_SIGNAL` would end it.
        """
        try:
            pidfd = os.pidfd_open(self.pid)
        except ProcessLookupError:
            return None
        # compare the start time while the pidfd holds the process
        is_it = started(self.pid) == self.started
        if is_it and self._does_with_signal("SigCgt"):
            return pidfd
        ending = self._does_with_signal("SigIgn")  # a loop ignores the signal after its last turn
        ended = not is_it or ending or bool(select.select([pidfd], [], [], 0.0)[0])
        os.close(pidfd)
        if ended:
            return None
        raise WorkFailedError(
            f"process {self.pid} is not a loop of user {self.uid}: no signal was sent"
        )

    def runs(self) -> bool:
        """Whether the process runs; raises WorkFailedError as `open` does."""
        if (pidfd := self.open()) is None:
            return False
        os.close(pidfd)
        return True

    def _does_with_signal(self, what: str) -> bool:
        """Whether the process belongs to its user and catches (SigCgt) or ignores (SigIgn) it."""
        try:
            lines = Path(f"/proc/{self.pid}/status").read_text().splitlines()
        except OSError:
            return False
        fields = dict(line.split(":\t", 1) for line in lines if ":\t" in line)
        does = int(fields[what], 16) >> (POWER_OFF_SIGNAL - 1) & 1
        return set(fields["Uid"].split()) == {str(self.uid)} and bool(does)


def find_loops(robot: str | None) -> list[Path]:
    """Return the files that name the loops of this robot, by name or file, or of any robot.

    A loop and its socket have the name of the robot. If a file is given, the loop must run that
    file.
    """
    paths = find_loop_files()
    return paths if robot is None else [path for path in paths if _is_of(path, robot)]


def _is_of(path: Path, robot: str) -> bool:
    name = short_name(robot)
    try:
        found = LoopFile.read(path)
    except WorkFailedError:  # the function that reads it reports the reason
        return path.stem == name
    if name not in (path.stem, found.robot):
        return False
    return name == robot or is_file_of(found.reference, Path(robot))


def started(pid: int) -> int:
    """Return the start time of a process in clock ticks since boot; 0 if it does not exist."""
    try:
        return int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[19])
    except OSError:
        return 0


_PROGRAMS: Final = ("cdpr", "cdpr_tools.cli")
_RUNS: Final = ("run", "start")
_RUNTIME_VARIABLE: Final = b"XDG_RUNTIME_DIR"
_NAMED_WITHIN_S: Final = 0.5
_MOST_LAUNCHER_BYTES: Final = 64


class LauncherLock:
    """The right of this process to run the daemon at this socket; its file names the launcher.

    The kernel keeps the lock until all processes that inherit `fd` have ended, however they end.
    """

    def __init__(self, socket: Path) -> None:
        """Take the lock; raises BadInputError if another process has it."""
        self._path = socket.with_suffix(LAUNCHER_SUFFIX)
        with os_error_as(BadInputError, f"--socket {socket}: {self._path}: cannot be locked"):
            self.fd = self._locked(socket)
            os.ftruncate(self.fd, 0)
            os.pwrite(self.fd, f"{os.getpid()} {started(os.getpid())}\n".encode(), 0)
        self._remove_loop_file(socket)

    def _remove_loop_file(self, socket: Path) -> None:
        """Remove the file of a killed loop; refuse if the loop runs and only its lock is gone."""
        path = LoopFile.beside(socket)
        with suppress(WorkFailedError):  # the file does not exist or is not trusted
            if LoopFile.read(path).runs():
                os.close(self.fd)
                raise _taken(socket, None)
        with suppress(OSError):
            path.unlink()

    def _locked(self, socket: Path) -> int:
        flags = os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW | os.O_NONBLOCK
        while True:
            fd = os.open(self._path, flags, 0o600)
            try:
                self._take(fd, socket)
                if self._is_at_path(fd):  # and was not removed by the launcher that had the lock
                    return fd
            except BaseException:
                os.close(fd)
                raise
            os.close(fd)

    def _take(self, fd: int, socket: Path) -> None:
        found = os.fstat(fd)
        if not stat.S_ISREG(found.st_mode) or not is_trusted(self._path, found.st_uid):
            raise BadInputError(
                f"--socket {socket}: {self._path} is not your file; remove it, or choose "
                "another --socket"
            )
        try:
            fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise _taken(socket, self._owner()) from None

    def _owner(self) -> int | None:
        """Return the process that has the lock; wait for its name if it has only just taken it."""
        end_s = time.monotonic() + _NAMED_WITHIN_S
        while (pid := launcher_pid(self._path)) is None and time.monotonic() < end_s:
            time.sleep(0.01)
        return pid

    def _is_at_path(self, fd: int) -> bool:
        try:
            return os.path.samestat(os.fstat(fd), self._path.lstat())
        except FileNotFoundError:
            return False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Release the lock; remove the file unless another process has inherited the lock."""
        ours = os.fstat(self.fd)
        os.close(self.fd)
        with suppress(OSError):
            fd = os.open(self._path, os.O_RDWR | os.O_CLOEXEC | os.O_NOFOLLOW | os.O_NONBLOCK)
            try:
                fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
                if os.path.samestat(ours, os.fstat(fd)) and self._is_at_path(fd):
                    self._path.unlink()
            finally:
                os.close(fd)


def _taken(socket: Path, pid: int | None) -> BadInputError:
    whose = "" if pid is None else f", process {pid}"
    return BadInputError(
        f"--socket {socket}: a daemon already runs there{whose}; `cdpr stop` ends it"
    )


def launcher_loads(robot: str | None, socket: Path | None) -> bool:
    """Return whether a `cdpr run` of this user has been started and has no lock yet.

    Such a launcher still loads its modules, which takes seconds on a busy machine. `robot` and
    `socket` select one; None stands for any robot, or the runtime folder.
    """
    return any(_loads(process, robot, socket) for process in Path("/proc").glob("[0-9]*"))


def _loads(process: Path, robot: str | None, socket: Path | None) -> bool:
    try:
        if process.stat().st_uid != os.geteuid():
            return False
        program, *words = (process / "cmdline").read_bytes().decode(errors="replace").split("\0")
        while words and words[0].startswith("-"):
            del words[0]
        is_run = len(words) > 1 and Path(words[0]).name in _PROGRAMS and words[1] in _RUNS
        if not is_run or not Path(program).name.startswith("python"):
            return False
        if socket is not None:
            is_it = str(socket) in words
        else:
            environment = (process / "environ").read_bytes().split(b"\0")
            variables = dict(each.partition(b"=")[::2] for each in environment)
            named = [word.removeprefix("--robot=") for word in words]
            named.append(variables.get(ROBOT_VARIABLE.encode(), b"").decode(errors="replace"))
            of_robot = robot is None or short_name(robot) in map(short_name, named)
            here = os.environb.get(_RUNTIME_VARIABLE) == variables.get(_RUNTIME_VARIABLE)
            is_it = of_robot and here and "--socket" not in words
        open_files = [fd.readlink().suffix for fd in (process / "fd").iterdir()] if is_it else []
    except OSError:  # it has ended
        return False
    return is_it and LAUNCHER_SUFFIX not in open_files


def launcher_pid(path: Path) -> int | None:
    """Return the pid of the launcher that the file names.

    None if the launcher does not run, or if the file is not trusted.
    """
    try:
        with os.fdopen(open_regular(path, links=False), "rb") as file:
            pid, since = map(int, file.read(_MOST_LAUNCHER_BYTES).split())
            trusted = is_trusted(path, os.fstat(file.fileno()).st_uid)
    except (OSError, ValueError, ProfileError):
        return None
    return pid if trusted and since > 0 and started(pid) == since else None

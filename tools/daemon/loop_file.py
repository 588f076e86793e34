"""The files that name a daemon's loop and its launcher, beside the daemon's socket.

By that of the loop a signal can have its process take the power: the launcher writes it once the
loop obeys `POWER_OFF_SIGNAL`.
What it says is believed of its owner's own processes only: who reads it may be root.
"""

from __future__ import annotations

import os
import select
import signal
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Annotated, Final

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError

from cdpr_profiles.errors import ProfileError, brief
from cdpr_profiles.reading.bounded_input import open_regular, parse_json
from cdpr_tools.daemon.paths import LAUNCHER_SUFFIX, LOOP_SUFFIX, is_trusted
from cdpr_tools.errors import WorkFailedError

POWER_OFF_SIGNAL: Final = signal.SIGUSR1
"""Has a loop take torque and power from its drives at once and latch a fault."""
_MOST_BYTES = 4096
_MOST_PID = 1 << 22
_MOST_FD = 1 << 20


class LoopFile(BaseModel):
    """Which process runs a robot's loop, and where its shared memory is."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    robot: Annotated[str, AfterValidator(brief)]
    uid: int = Field(ge=0)
    """User id of the process, who owns the file as well."""
    pid: int = Field(gt=1, le=_MOST_PID)
    started: int = Field(ge=0)
    """When it was started, in clock ticks since the machine was: no other process has both."""
    block_fd: int = Field(ge=0, le=_MOST_FD)
    """The descriptor of the shared memory, in that process."""
    drives_stop_s: float = Field(ge=0.0, allow_inf_nan=False)
    """Within what time the drives stop by themselves once the loop is silent."""

    @staticmethod
    def beside(socket: Path) -> Path:
        """Return where the file of the daemon with this socket lies."""
        return socket.with_suffix(LOOP_SUFFIX)

    def write(self, path: Path) -> None:
        """Put the file there, for this user only, whole or not at all. Raises OSError."""
        fd, fresh = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)  # mode 0600
        try:
            with os.fdopen(fd, "w") as file:
                file.write(self.model_dump_json())
            Path(fresh).replace(path)
        except OSError:
            Path(fresh).unlink()
            raise

    def remove(self, path: Path) -> None:
        """Take the file away where it still says this and not what another daemon wrote."""
        with suppress(WorkFailedError, OSError):
            if LoopFile.read(path) == self:
                path.unlink()

    @classmethod
    def read(cls, path: Path) -> LoopFile:
        """Return what is in the file; raises WorkFailedError, also for another user's."""
        try:
            with os.fdopen(open_regular(path, links=False), "rb") as file:
                owner = os.fstat(file.fileno()).st_uid
                data = file.read(_MOST_BYTES)
            if not is_trusted(path, owner):
                raise WorkFailedError(f"{path}: was put there by user {owner}: it is not believed")
            found = cls.model_validate(parse_json(data, path))
        except ProfileError as error:
            raise WorkFailedError(str(error)) from None
        except OSError as error:
            raise WorkFailedError(f"{path}: cannot be read: {error.strerror}") from None
        except ValidationError as error:
            what = error.errors()[0]["msg"]
            raise WorkFailedError(f"{path}: does not name a loop: {what}") from None
        if found.uid != owner:
            raise WorkFailedError(f"{path}: does not name a loop: it is of user {owner}")
        return found

    def open(self) -> int | None:
        """Return a pidfd of the process, None where it has ended or its loop has turned last.

        Raises WorkFailedError where it is another user's, or `POWER_OFF_SIGNAL` would end it.
        """
        try:
            pidfd = os.pidfd_open(self.pid)
        except ProcessLookupError:
            return None
        # looked at while the pidfd holds the process
        is_it = started(self.pid) == self.started
        if is_it and self._does_with_signal("SigCgt"):
            return pidfd
        ending = self._does_with_signal("SigIgn")  # a loop ignores it once it has turned last
        ended = not is_it or ending or bool(select.select([pidfd], [], [], 0.0)[0])
        os.close(pidfd)
        if ended:
            return None
        raise WorkFailedError(
            f"process {self.pid} is no loop of user {self.uid}: nothing was sent to it"
        )

    def runs(self) -> bool:
        """Whether the process runs; raises WorkFailedError as `open` does."""
        if (pidfd := self.open()) is None:
            return False
        os.close(pidfd)
        return True

    def _does_with_signal(self, what: str) -> bool:
        """Whether the process is all its user's and catches (SigCgt) or ignores (SigIgn) it."""
        try:
            lines = Path(f"/proc/{self.pid}/status").read_text().splitlines()
        except OSError:
            return False
        fields = dict(line.split(":\t", 1) for line in lines if ":\t" in line)
        does = int(fields[what], 16) >> (POWER_OFF_SIGNAL - 1) & 1
        return set(fields["Uid"].split()) == {str(self.uid)} and bool(does)


def started(pid: int) -> int:
    """Return when a process was started, in clock ticks since the machine was; 0 for none."""
    try:
        return int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[19])
    except OSError:
        return 0


_MOST_DOING: Final = 160
_MOST_LAUNCHER_BYTES: Final = 64 + _MOST_DOING


@contextmanager
def named_launcher(socket: Path) -> Iterator[Callable[[str], None]]:
    """Name this process as the launcher of the daemon with this socket, while the block runs.

    Yields a function that tells clients what the launcher is doing, up to 160 characters.
    Nobody is told where the file cannot be written: clients only do not wait then.
    """
    path = socket.with_suffix(LAUNCHER_SUFFIX)
    name = f"{os.getpid()} {started(os.getpid())}\n".encode()

    def tell(text: str) -> None:
        with suppress(OSError):  # in one write, which leaves the name as it is
            os.pwrite(
                fd, text[:_MOST_DOING].ljust(_MOST_DOING).encode("ascii", "replace"), len(name)
            )

    fd = -1
    with suppress(OSError):
        path.unlink(missing_ok=True)  # of one that was killed
        fd = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
        os.write(fd, name)
    try:
        yield tell
    finally:
        with suppress(OSError):
            path.unlink()
        with suppress(OSError):
            os.close(fd)


def launcher_does(path: Path) -> str | None:
    """Return what the launcher that the file names is doing, as far as it tells.

    None where it does not run, or where the file cannot be believed.
    """
    try:
        with os.fdopen(open_regular(path, links=False), "rb") as file:
            name, _, doing = file.read(_MOST_LAUNCHER_BYTES).decode("ascii").partition("\n")
            trusted = is_trusted(path, os.fstat(file.fileno()).st_uid)
        pid, since = map(int, name.split())
    except (OSError, ValueError, ProfileError):
        return None
    return brief(doing.strip()) if trusted and since > 0 and started(pid) == since else None

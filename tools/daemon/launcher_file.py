"""The file that names a daemon's launcher, beside its socket and from before there is one."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

from cdpr_profiles.errors import ProfileError
from cdpr_profiles.reading.bounded_input import open_regular
from cdpr_tools.daemon.loop_file import started
from cdpr_tools.daemon.paths import LAUNCHER_SUFFIX, is_trusted

_MOST_BYTES: Final = 64


@contextmanager
def named_launcher(socket: Path) -> Iterator[None]:
    """Name this process as the launcher of the daemon with this socket, while the block runs.

    Nobody is told where the file cannot be written: clients only do not wait then.
    """
    path = socket.with_suffix(LAUNCHER_SUFFIX)
    with suppress(OSError):
        path.unlink(missing_ok=True)  # of one that was killed
        with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as file:
            file.write(f"{os.getpid()} {started(os.getpid())}")
    try:
        yield
    finally:
        with suppress(OSError):
            path.unlink()


def launcher_runs(path: Path) -> bool:
    """Whether the launcher that the file names runs; not where the file cannot be believed."""
    try:
        with os.fdopen(open_regular(path, links=False), "rb") as file:
            words = file.read(_MOST_BYTES).split()
            trusted = is_trusted(path, os.fstat(file.fileno()).st_uid)
        pid, since = map(int, words)
    except (OSError, ValueError, ProfileError):
        return False
    return trusted and since > 0 and started(pid) == since

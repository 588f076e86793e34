"""Ends a daemon whose service does not answer: its loop is asked by a signal."""

from __future__ import annotations

import os
import select
import signal
from pathlib import Path
from typing import Final

from cdpr_tools.daemon.loop_file import LoopFile
from cdpr_tools.daemon.paths import find_loop_files
from cdpr_tools.errors import BadInputError, WorkFailedError

_END_S: Final = 90.0
"""A platform is let down in less."""


def end_left_over(robot: str | None, socket: Path | None) -> list[str]:
    """Have a loop that runs without a service stop under control; return what was done, as lines.

    Nothing is done, and no line returned, where none runs. Raises BadInputError where several do
    and none was named, WorkFailedError where it is another user's or does not end.
    """
    paths = find_loop_files(robot) if socket is None else [LoopFile.beside(socket)]
    found = [LoopFile.read(path) for path in paths if path.exists()]
    running = [one for one in found if one.runs()]
    if len(running) > 1 and robot is None:
        names = ", ".join(one.robot for one in running)
        raise BadInputError(f"{len(running)} loops run: choose one by --robot ({names})")
    return [_end(one) for one in running[:1]]


def _end(loop: LoopFile) -> str:
    pidfd = loop.open()
    if pidfd is None:
        return f"{loop.robot}: its loop has ended"
    try:
        signal.pidfd_send_signal(pidfd, signal.SIGTERM)
        if not select.select([pidfd], [], [], _END_S)[0]:
            raise WorkFailedError(f"{loop.robot}: its loop still runs {_END_S:g} s after SIGTERM")
    except PermissionError:
        raise WorkFailedError(f"{loop.robot}: its loop is another user's") from None
    finally:
        os.close(pidfd)
    return f"{loop.robot}: its service did not answer; its loop was stopped under control"

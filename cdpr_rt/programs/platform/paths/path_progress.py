"""How far a robot has come on its last path, on the disk: written by the service, not the loop."""

from __future__ import annotations

import asyncio
import os
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from cdpr_rt.core.shared_block import PATH
from cdpr_rt.private_files import FILE_MODE, make_private_folder
from cdpr_rt.state_file import state_path

_EVERY_S: Final = 0.5
_LOOKS: Final = 3


def paths_folder(robot: str) -> Path:
    """Return where the plans for a robot's profile lie, and how far the last one has come."""
    return state_path("paths", robot).with_suffix("")


def progress_file(folder: Path, *, simulated: bool = False) -> Path:
    """Return the file of how far the last path has come, or has come in simulation."""
    return folder / ("progress.simulated" if simulated else "progress")


def read_progress(folder: Path, *, simulated: bool = False) -> NDArray[Any]:
    """Return what a folder of paths says, one `PATH` row: of no path where it says nothing."""
    nothing = np.zeros(1, PATH)
    try:
        rows = np.fromfile(progress_file(folder, simulated=simulated), PATH, 1)
    except OSError:
        return nothing
    return rows if rows.size else nothing


def write_progress(folder: Path, row: NDArray[Any], *, simulated: bool = False) -> None:
    """Write a `PATH` row, (1,), into a folder of paths; raises OSError."""
    make_private_folder(folder)
    flags = os.O_WRONLY | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW
    fd = os.open(progress_file(folder, simulated=simulated), flags, FILE_MODE)
    try:
        os.pwrite(fd, row.tobytes(), 0)
    finally:
        os.close(fd)


async def keep_progress(folder: Path, live: NDArray[Any], *, simulated: bool = False) -> None:
    """Have the disk follow a `PATH` row that the loop writes, until cancelled.

    A disk that is full keeps what it has until space is free: the path is followed all the same.
    """
    kept = b""
    try:
        while True:
            row = _settled(live)
            if row is not None and row["name"][0] and row.tobytes() != kept:
                written = await asyncio.to_thread(_try_to_write, folder, row, simulated)
                kept = row.tobytes() if written else kept
            await asyncio.sleep(_EVERY_S)
    finally:
        row = _settled(live)
        if row is not None and row["name"][0]:
            _try_to_write(folder, row, simulated)


def _settled(live: NDArray[Any]) -> NDArray[Any] | None:
    """Return a copy of a row; None where another path is being begun in it at this moment."""
    for _ in range(_LOOKS):
        row = live.copy()
        if (row[["name", "over"]] == live[["name", "over"]]).all():
            return row
    return None


def _try_to_write(folder: Path, row: NDArray[Any], simulated: bool) -> bool:
    try:
        write_progress(folder, row, simulated=simulated)
    except OSError:
        return False
    return True

"""The present user's own folders for data that programs keep."""

from __future__ import annotations

import os
import stat
import tempfile
from pathlib import Path


def state_folder() -> Path:
    """Return the folder of lasting data: $XDG_STATE_HOME or ~/.local/state, /cdpr-rt."""
    base = os.environ.get("XDG_STATE_HOME", "")
    if base.startswith("/"):
        return Path(base) / "cdpr-rt"
    try:
        home = Path.home()
    except RuntimeError:  # a user id without a name, and no HOME
        home = Path("/nonexistent")
    return home / ".local" / "state" / "cdpr-rt"


def temporary_folder() -> Path:
    """Return the folder of this user's temporary files."""
    return Path(f"/tmp/cdpr-rt-{os.geteuid()}")


def is_private(folder: Path, owner: int | None) -> bool:
    """Return whether a folder (no link) is writable only by `owner`; None allows any owner."""
    try:
        held = folder.lstat()
    except OSError:
        return False
    alone = not held.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
    return stat.S_ISDIR(held.st_mode) and alone and owner in (None, held.st_uid)


def can_write(folder: Path) -> bool:
    """Return whether a file can be written into a folder that exists or can be made."""
    try:
        there = next(one for one in (folder, *folder.parents) if one.exists())
        tempfile.TemporaryFile(dir=there).close()  # this file has no name there
    except OSError:
        return False
    return True

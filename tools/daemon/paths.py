"""Where a daemon's socket and recordings lie, and how a client finds them again."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterable
from pathlib import Path
from typing import Final

from cdpr_tools.errors import BadInputError

LOOP_SUFFIX: Final = ".loop"
SOCKET_SUFFIX: Final = ".sock"
LAUNCHER_SUFFIX: Final = ".launcher"
_FOLDER = "cdpr-rt"
_SYSTEM = Path("/run") / _FOLDER


def default_socket(robot: str) -> Path:
    """Return the socket of the daemon that this user runs for the robot of this short name.

    Its folder is made where it is missing, for this user only. Raises BadInputError where
    somebody else holds the folder.
    """
    folder = _runtime_folder()
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    except OSError as error:
        raise BadInputError(f"{folder}: cannot be made: {error.strerror}; give --socket") from None
    if not _is_owned_by(folder, os.geteuid()):
        raise BadInputError(f"{folder}: is open to others or not this user's; give --socket")
    return folder / f"{robot}{SOCKET_SUFFIX}"


def find_sockets(robot: str | None = None) -> list[Path]:
    """Return the sockets of daemons, of one robot or of any: this user's first, then the system's.

    A socket that is found may be left over from a daemon that was killed. Nothing is looked for in
    a folder that somebody else has made or may write to.
    """
    return [path for path in _find(robot, SOCKET_SUFFIX) if path.is_socket()]


def find_loop_files(robot: str | None = None) -> list[Path]:
    """Return the files that name the loops of daemons, found as sockets are."""
    return _find(robot, LOOP_SUFFIX)


def find_launcher_files(robot: str | None = None) -> list[Path]:
    """Return the files that name the launchers of daemons, found as sockets are."""
    return _find(robot, LAUNCHER_SUFFIX)


def unsearched_folders() -> str:
    """Return in words where daemons were not looked for though some may be there."""
    folder, reasons = _runtime_folder(), []
    if os.path.lexists(folder) and not _is_owned_by(folder, os.geteuid()):
        reasons.append(f"{folder} is open to others or not this user's, and was not looked into")
    if _SYSTEM.is_dir() and not os.access(_SYSTEM, os.R_OK | os.X_OK):
        reasons.append(f"{_SYSTEM} is closed to this user, try it with `sudo`")
    return "; ".join(reasons)


def found_instead(running: Iterable[Path], remark: str = "") -> str:
    """Return in words which daemons run besides one that was not found, and what was not searched.

    `running` are files of theirs, `remark` is said of them; empty where there is nothing to say.
    """
    names = ", ".join(path.stem for path in running)
    hints = names and f"what runs: {names}{remark}", unsearched_folders()
    return "".join(f"; {hint}" for hint in hints if hint)


def is_trusted(path: Path, owner: int) -> bool:
    """Whether a file of this owner at `path` is this user's, or of who owns its folder."""
    try:
        return owner in (os.geteuid(), path.parent.stat().st_uid)
    except OSError:  # the folder has been removed meanwhile
        return False


def _find(robot: str | None, suffix: str) -> list[Path]:
    if robot is not None and robot.endswith(".toml"):  # the file whose short name the daemon has
        robot = Path(robot).stem
    found = []
    # only root makes folders in /run: the owner of ours is the daemons' user
    for folder, owner in ((_runtime_folder(), os.geteuid()), (_SYSTEM, None)):
        try:
            files = folder.iterdir() if _is_owned_by(folder, owner) else ()
            found += sorted(
                path for path in files if path.suffix == suffix and robot in (None, path.stem)
            )
        except OSError:  # not for this user to look into
            continue
    return found


def _is_owned_by(folder: Path, owner: int | None) -> bool:
    """Whether there is a folder, no link to one, of this owner alone; None for any."""
    try:
        held = folder.lstat()
    except OSError:
        return False
    alone = not held.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
    return stat.S_ISDIR(held.st_mode) and alone and owner in (None, held.st_uid)


def default_recordings() -> Path:
    """Return the folder of recordings: $XDG_STATE_HOME/cdpr-rt/recordings, or in the home."""
    base = os.environ.get("XDG_STATE_HOME", "")
    state = Path(base) if base.startswith("/") else Path.home() / ".local" / "state"
    return state / _FOLDER / "recordings"


def _runtime_folder() -> Path:
    base = os.environ.get("XDG_RUNTIME_DIR", "")
    if base.startswith("/"):
        return Path(base) / _FOLDER
    folder = Path(f"/run/user/{os.geteuid()}")
    return folder / _FOLDER if folder.is_dir() else Path(f"/tmp/{_FOLDER}-{os.geteuid()}")

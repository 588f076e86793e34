"""Locations of a daemon's socket and recordings, and how clients find them."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Final

from cdpr_profiles.places import reference
from cdpr_profiles.user_folders import is_private, state_folder, temporary_folder
from cdpr_tools.errors import BadInputError

LOOP_SUFFIX: Final = ".loop"
SOCKET_SUFFIX: Final = ".sock"
LAUNCHER_SUFFIX: Final = ".launcher"
_FOLDER = "cdpr-rt"
_SYSTEM = Path("/run") / _FOLDER


def default_socket(robot: str) -> Path:
    """Return the socket of this user's daemon for the robot with this short name.

    Its folder is created if missing, for this user only. Raises BadInputError if
    another user owns the folder.
    """
    folder = runtime_folder()
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    except OSError as error:
        raise BadInputError(
            f"{folder}: cannot be created: {error.strerror}; give --socket"
        ) from None
    if not is_private(folder, os.geteuid()):
        raise BadInputError(f"{folder}: is open to others or not this user's; give --socket")
    return folder / f"{robot}{SOCKET_SUFFIX}"


def find_sockets(robot: str | None = None) -> list[Path]:
    """Return the sockets of daemons, for one robot or any: this user's first, then the system's.

    A socket may be left over from a killed daemon. Folders that another user has created or
    may write to are not searched.
    """
    return [path for path in _find(robot, SOCKET_SUFFIX) if path.is_socket()]


def short_name(robot: str) -> str:
    """Return the daemon's name for a robot that is given by name or by file."""
    return Path(robot).stem if robot.endswith(".toml") else robot


def is_file_of(robot: str, path: Path) -> bool:
    """Whether a daemon that runs the robot `robot` runs the file at `path`."""
    path = path.resolve()
    return robot in (reference("robots", path), reference("winches", path))


def find_loop_files() -> list[Path]:
    """Return the files that name the loops of daemons, found like sockets."""
    return _find(None, LOOP_SUFFIX)


def find_launcher_files(robot: str | None = None) -> list[Path]:
    """Return the files that name the launchers of daemons, found like sockets."""
    return _find(robot, LAUNCHER_SUFFIX)


def unsearched_folders() -> str:
    """Return as text which folders were not searched although daemons may be there."""
    folder, reasons = runtime_folder(), []
    if os.path.lexists(folder) and not is_private(folder, os.geteuid()):
        reasons.append(f"{folder} is open to others or not this user's, so it was not searched")
    if _SYSTEM.is_dir() and not os.access(_SYSTEM, os.R_OK | os.X_OK):
        reasons.append(f"{_SYSTEM} is closed to this user; try `sudo`")
    return "; ".join(reasons)


def found_instead(running: Iterable[Path], remark: str = "") -> str:
    """Return as text the other running daemons and the folders that were not searched.

    `running` are their files, `remark` is added to them; empty if there is nothing to report.
    """
    names = ", ".join(path.stem for path in running)
    hints = names and f"running: {names}{remark}", unsearched_folders()
    return "".join(f"; {hint}" for hint in hints if hint)


def is_trusted(path: Path, owner: int) -> bool:
    """Whether a file of this owner at `path` belongs to this user or to the folder's owner."""
    try:
        return owner in (os.geteuid(), path.parent.stat().st_uid)
    except OSError:  # the folder has been removed in the meantime
        return False


def _find(robot: str | None, suffix: str) -> list[Path]:
    if robot is not None:
        robot = short_name(robot)
    found = []
    # only root creates folders in /run: the owner of this one is the daemons' user
    for folder, owner in ((runtime_folder(), os.geteuid()), (_SYSTEM, None)):
        try:
            files = folder.iterdir() if is_private(folder, owner) else ()
            found += sorted(
                path for path in files if path.suffix == suffix and robot in (None, path.stem)
            )
        except OSError:  # this user may not read the folder
            continue
    return found


def default_recordings() -> Path:
    """Return the folder of recordings: `recordings` in the state folder."""
    return state_folder() / "recordings"


def runtime_folder() -> Path:
    """Return the folder of this user's sockets, without creating it."""
    base = os.environ.get("XDG_RUNTIME_DIR", "")
    if base.startswith("/"):
        return Path(base) / _FOLDER
    folder = Path(f"/run/user/{os.geteuid()}")
    return folder / _FOLDER if folder.is_dir() else temporary_folder()

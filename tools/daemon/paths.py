"""Where a daemon's socket and recordings lie, and how a client finds them again."""

from __future__ import annotations

import os
from pathlib import Path

from tools.errors import BadInputError

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
        held = folder.lstat()
    except OSError as error:
        raise BadInputError(f"{folder}: cannot be made: {error.strerror}; give --socket") from None
    if folder.is_symlink() or held.st_uid != os.geteuid() or held.st_mode & 0o022:
        raise BadInputError(f"{folder}: is open to others or not this user's; give --socket")
    return folder / f"{robot}.sock"


def find_sockets(robot: str | None = None) -> list[Path]:
    """Return the sockets of daemons, of one robot or of any: this user's first, then the system's.

    A socket that is found may be left over from a daemon that was killed.
    """
    pattern = "*.sock" if robot is None else f"{robot}.sock"
    found = []
    for folder in (_runtime_folder(), _SYSTEM):
        try:
            found += sorted(path for path in folder.glob(pattern) if path.is_socket())
        except OSError:  # not for this user to look into
            continue
    return found


def default_recordings() -> Path:
    """Return the folder of recordings: $XDG_STATE_HOME/cdpr-rt/recordings, or in the home."""
    base = os.environ.get("XDG_STATE_HOME", "")
    state = Path(base) if base.startswith("/") else Path.home() / ".local" / "state"
    return state / _FOLDER / "recordings"


def _runtime_folder() -> Path:
    base = os.environ.get("XDG_RUNTIME_DIR", "")
    if base.startswith("/"):
        return Path(base) / _FOLDER
    own = Path(f"/run/user/{os.geteuid()}")
    return own / _FOLDER if own.is_dir() else Path(f"/tmp/{_FOLDER}-{os.geteuid()}")

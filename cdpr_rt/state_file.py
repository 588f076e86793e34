"""Small files that outlive a command: one JSON object each, replaced atomically."""

from __future__ import annotations

import json
import os
import re
from pathlib import Path
from typing import Any, Final

from cdpr_profiles.bounded_input import read_json, replacing
from cdpr_profiles.errors import FileMissingError, ProfileError
from cdpr_profiles.user_folders import state_folder
from cdpr_rt.errors import ControlError

# These files are private to the programs: only the user who runs them needs access.

FILE_MODE: Final = 0o600
FOLDER_MODE: Final = 0o700


def make_private_folder(folder: Path) -> None:
    """Create a folder that only this user can access, and its missing parents; raises OSError."""
    missing = [one for one in (folder, *folder.parents) if not one.exists()]
    for one in reversed(missing):
        one.mkdir(mode=FOLDER_MODE, exist_ok=True)


_MOST_BYTES = 1 << 16


class StateFileError(ControlError):
    """A state file cannot be read, written or understood; the message names the file."""


def state_path(kind: str, name: str) -> Path:
    """Return the file that keeps the state of `kind` for `name`.

    The file is in $XDG_STATE_HOME/cdpr-rt, by default ~/.local/state/cdpr-rt.
    """
    safe = re.sub(r"[^A-Za-z0-9_.-]", "-", name)
    return state_folder() / f"{kind}.{safe}.json"


def read_state(path: Path) -> dict[str, Any] | None:
    """Return the file's content, None if there is no file; raises StateFileError."""
    try:
        held = read_json(path, _MOST_BYTES)
    except FileMissingError:
        return None
    except ProfileError as error:
        raise StateFileError(f"{path}: is damaged: {error.problem}") from None
    if not isinstance(held, dict):
        raise StateFileError(f"{path}: is damaged: it does not hold one JSON object")
    return held


def write_state(path: Path, state: dict[str, Any]) -> None:
    """Replace the file atomically: a power loss leaves the old or the new one.

    Raises StateFileError.
    """
    try:
        make_private_folder(path.parent)
        with replacing(path, FILE_MODE) as file:
            file.write(json.dumps(state, indent=1).encode() + b"\n")
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:
        raise StateFileError(f"{path}: cannot be written: {error.strerror}") from error


def remove_state(path: Path) -> None:
    """Remove the file if it exists; raises StateFileError."""
    try:
        path.unlink(missing_ok=True)
    except OSError as error:
        raise StateFileError(f"{path}: cannot be removed: {error.strerror}") from error

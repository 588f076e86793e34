"""Write reports and pictures atomically; never overwrite a file of somebody else."""

from __future__ import annotations

import errno
from pathlib import Path
from typing import Final

from cdpr_profiles.bounded_input import may_replace, replacing
from cdpr_tools.errors import BadInputError, WorkFailedError, os_error_as

OWN_MARK: Final = b"cdpr-rt"
"""Mark at the beginning of each report and picture; a file with it may be replaced."""


def require_own(path: Path) -> None:
    """Raise FileExistsError if `path` holds something that was not written by this project."""
    if not may_replace(path, OWN_MARK):
        text = "already exists and was not written by cdpr; move it, or choose another name"
        raise FileExistsError(errno.EEXIST, text)


def require_free(option: str, path: Path, overwrite: bool) -> None:
    """Raise BadInputError if a file, or files in a folder, exist and `overwrite` is not given."""
    with os_error_as(BadInputError, f"{option} {path}: cannot be written"):
        occupied = any(path.iterdir()) if path.is_dir() else path.exists()
    if occupied and not overwrite:
        raise BadInputError(
            f"{option} {path}: already exists; choose another name, or replace it with --overwrite"
        )


def save(path: Path, content: str | bytes) -> None:
    """Write a file completely or not at all; raise WorkFailedError if it cannot be written.

    A page or a picture replaces only a file that this project wrote.
    """
    with os_error_as(WorkFailedError, f"{path}: cannot be written"):
        if path.suffix in (".html", ".png"):
            require_own(path)
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as file:
            file.write(content.encode() if isinstance(content, str) else content)

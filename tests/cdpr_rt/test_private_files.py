"""State files and folders are private to their user, whatever the umask."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from pathlib import Path

import pytest
from foxglove import Context

from cdpr_rt.service.recording_file import RecordingFile
from cdpr_rt.state_file import write_state


@pytest.fixture
def open_umask() -> Iterator[None]:
    before = os.umask(0o000)
    yield
    os.umask(before)


def mode(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


@pytest.mark.parametrize("kind", ["recording", "state"])
def test_folders_and_files_are_readable_by_their_user_only(
    open_umask: None, tmp_path: Path, kind: str
) -> None:
    path = tmp_path / "cdpr-rt" / "kept" / "file"
    if kind == "recording":
        RecordingFile(path, Context(), {}).close()
    else:
        write_state(path, {"known": True})
    assert mode(path) == 0o600
    assert (mode(path.parent), mode(path.parent.parent)) == (0o700, 0o700)

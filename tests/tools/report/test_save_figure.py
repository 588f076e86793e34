"""Pictures are there as a whole or not at all."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import matplotlib.image
import pytest
from matplotlib.figure import Figure

from cdpr_tools.report.style import save_figure


def test_a_picture_replaces_the_one_before(tmp_path: Path) -> None:
    path = tmp_path / "it.png"
    path.write_bytes(b"old")
    save_figure(Figure((1.0, 1.0)), path)
    assert matplotlib.image.imread(path).shape[:2] == (170, 170)
    assert [one.name for one in tmp_path.iterdir()] == ["it.png"]


def test_a_full_disk_leaves_no_part_of_a_picture(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "it.png"
    path.write_bytes(b"old")

    def full(self: Path, data: bytes) -> int:
        self.open("wb").write(data[:100])
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(OSError, match="No space left"):
        save_figure(Figure((1.0, 1.0)), path)
    assert [one.name for one in tmp_path.iterdir()] == ["it.png"] and path.read_bytes() == b"old"

"""Pictures are written completely or not at all."""

from __future__ import annotations

import resource
from pathlib import Path

import matplotlib.image
import pytest
from matplotlib.figure import Figure

from cdpr_tools.errors import WorkFailedError
from cdpr_tools.saving import save
from cdpr_tools.style import save_figure


def test_a_picture_replaces_the_previous_one(tmp_path: Path) -> None:
    path = tmp_path / "it.png"
    save_figure(Figure((2.0, 2.0)), path)
    save_figure(Figure((1.0, 1.0)), path)
    assert matplotlib.image.imread(path).shape[:2] == (170, 170)
    assert [one.name for one in tmp_path.iterdir()] == ["it.png"]


def test_a_full_disk_keeps_the_previous_picture(tmp_path: Path) -> None:
    path = tmp_path / "it.png"
    path.write_bytes(b"old, of cdpr-rt")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, hard))
    try:
        with pytest.raises(WorkFailedError, match=r"it\.png: cannot be written: File too large"):
            save_figure(Figure((1.0, 1.0)), path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert [one.name for one in tmp_path.iterdir()] == ["it.png"]
    assert path.read_bytes() == b"old, of cdpr-rt"


def test_a_picture_or_page_of_the_user_is_not_replaced(tmp_path: Path) -> None:
    picture, report = tmp_path / "holiday.png", tmp_path / "report.html"
    picture.write_bytes(b"a beach")
    report.write_text("<title>Thesis</title>")
    with pytest.raises(WorkFailedError, match="was not written by cdpr"):
        save_figure(Figure((1.0, 1.0)), picture)
    with pytest.raises(WorkFailedError, match="was not written by cdpr"):
        save(report, "<title>Motor</title>")
    assert picture.read_bytes() == b"a beach"
    report.unlink()
    save(report, "<!-- cdpr-rt --> first")
    save(report, "<!-- cdpr-rt --> second")
    assert "second" in report.read_text()

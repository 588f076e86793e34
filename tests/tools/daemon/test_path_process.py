"""Planning in a process of its own: what it may take of the machine."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from cdpr_tools.daemon import service_process


def test_a_file_does_not_take_more_memory_than_it_is_given(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "part.nc"
    file.write_text("M2\n")
    wanted = {"blend_mm": 1.0, "ignore": "", "origin_mm": None}
    small = service_process._WITHIN.replace(str(service_process._MOST_KiB), str(100 << 10))
    monkeypatch.setattr(service_process, "_WITHIN", small)
    status, text = asyncio.run(service_process.plan_in_process("planar-3", file, wanted))
    assert status != 0 and not text.startswith("{")

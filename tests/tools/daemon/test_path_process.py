"""Path planning in a separate process with limited resources."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from cdpr_tools.daemon import service_process


def test_planning_a_file_is_limited_in_memory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "part.nc"
    file.write_text("M2\n")
    wanted = {"blend_mm": 1.0, "ignore": "", "origin_mm": None}
    small = service_process._WITHIN.replace(str(service_process._MOST_KiB), str(100 << 10))
    monkeypatch.setattr(service_process, "_WITHIN", small)
    status, text = asyncio.run(service_process.plan_in_process("planar-3", file, wanted))
    assert status != 0 and not text.startswith("{")

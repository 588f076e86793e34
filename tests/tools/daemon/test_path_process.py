"""Path planning in a separate process with limited resources."""

from __future__ import annotations

import asyncio
from pathlib import Path

from cdpr_tools.daemon import service_process


def test_planning_a_file_is_limited_in_memory(tmp_path: Path) -> None:
    file = tmp_path / "part.nc"
    file.write_text("M2\n")
    wanted = {"blend_mm": 1.0, "ignore": "", "origin_mm": None}
    planning = service_process.plan_in_process("planar-3", file, wanted, most_KiB=100 << 10)
    status, text = asyncio.run(planning)
    assert status != 0 and not text.startswith("{")

"""Write recordings of given rows and statuses of the loop."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from cdpr_rt.core.cycle_row import Row
from cdpr_rt.core.shared_block import RowWriter
from cdpr_rt.service.recording import Recorder
from tests.cdpr_rt.service.recording_rig import block_with_clock, put

LEFT_RIGHT = [{"name": "left"}, {"name": "right"}]


def record(
    folder: Path,
    rows: Row,
    n: int = 2,
    said: Sequence[tuple[int, dict[str, Any]]] = (),
    clock: pytest.MonkeyPatch | None = None,
    **described: Any,
) -> Path:
    """Record rows of `n` axes and return the file. `said` gives statuses from certain rows on.

    With `clock`, the machine's time is that of the previous row.
    """
    block = block_with_clock(n=n)
    block.write_description({"robot": "bench", **described})
    recorder, writer = Recorder(block, folder, "bench", reserve_bytes=0), RowWriter(block)
    recorder.begin()
    first = 0
    for row, status in said:
        put(writer, rows[first:row])
        first = row
        if clock is not None:
            clock.setattr(time, "monotonic_ns", lambda at=int(rows["stamp_ns"][row - 1]): at)
        block.write_status({"state": "active", "reason": "", **status})
        recorder.look()
    put(writer, rows[first:])
    recorder.finish()
    return Path(recorder.status()["file"])

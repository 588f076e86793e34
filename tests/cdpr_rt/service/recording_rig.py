"""Rows like a robot's, and a recorder in a separate process."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import numpy as np
from mcap.reader import make_reader

from cdpr_rt.core.cycle_row import AXES, Row, cycle_dtype
from cdpr_rt.core.shared_block import RowWriter, SharedBlock
from cdpr_rt.core.states import LoopState

PERIOD_s = 1e-3
DESCRIPTION = {
    "robot": "bench",
    "period_s": PERIOD_s,
    "axes": [{"name": "left"}, {"name": "right"}],
    "programs": ["idle", "hold", "jog"],
    "version": "0.0",
}


def made_rows(first: int, count: int, n: int = 2) -> Row:
    """Return rows `first` to `first + count` of one endless run, stamped in steps of a period."""
    rows = np.zeros(count, cycle_dtype(n))
    cycles = np.arange(first, first + count)
    rows["cycle"] = cycles
    rows["time_s"] = cycles * PERIOD_s
    rows["stamp_ns"] = 5_000_000_000 + cycles * 1_000_000
    rows["state"] = LoopState.ACTIVE
    rows["limit_axis"] = -1
    for k, name in enumerate(AXES[:12]):
        rows[name] = np.sin(cycles * 1e-3 + k)[:, None] * np.arange(1, n + 1)
    rows["cable_length_m"] = np.nan
    rows["stream_age_s"] = np.nan
    rows["pose"] = rows["pose_setpoint"] = np.nan
    rows["valid"] = True
    rows["statusword"] = 0x1237
    return rows


def block_with_clock(seconds: float = 10.0, n: int = 2) -> SharedBlock:
    """Return a block as the launcher makes it, described."""
    block = SharedBlock.create(n, seconds, 1.0 / PERIOD_s)
    block.counters["start_monotonic_ns"] = 5_000_000_000
    block.counters["start_realtime_ns"] = 1_800_000_000_000_000_000
    block.write_description(DESCRIPTION)
    block.write_status({"state": "active", "reason": ""})
    return block


def put(writer: RowWriter, rows: Row) -> None:
    """Write `rows` as the loop does, one after the other."""
    for k in range(rows.size):
        writer.slot()[:] = rows[k]
        writer.commit()


def run_for(writer: RowWriter, seconds: float, first: int) -> int:
    """Write rows at their pace; return the number of the next one."""
    began = time.monotonic()
    at = first
    while (passed := time.monotonic() - began) < seconds:
        due = first + round(passed / PERIOD_s)
        put(writer, made_rows(at, due - at))
        at = due
        time.sleep(0.005)
    return at


def stock_messages(path: Path, topic: str) -> list[tuple[int, dict[str, Any]]]:
    """Read log times and values from a file with the `mcap` package alone."""
    with path.open("rb") as file:
        messages = make_reader(file, validate_crcs=True).iter_messages(topics=[topic])
        return [(message.log_time, json.loads(message.data)) for _, _, message in messages]


def stock_cycles(*paths: Path) -> list[int]:
    """Return the cycle numbers in files, one after the other."""
    return [row["cycle"] for path in paths for _, row in stock_messages(path, "/cycle")]

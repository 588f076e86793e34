"""The cost of a frame on a real SocketCAN interface, compared with python-can."""

from __future__ import annotations

import pytest

from cdpr_tools.bench.bus import measure_vcan
from cdpr_tools.output import Output

pytestmark = pytest.mark.vcan


def test_bench_measures_frames_on_vcan_for_both_ports() -> None:
    rows = measure_vcan(200, Output(as_json=True))
    assert list(rows) == ["socketcan, ours", "socketcan, python-can"]
    for row in rows.values():
        assert row["frames/s"] > 100
        assert row["CPU mean"] > 0.0

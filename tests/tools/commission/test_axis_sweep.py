"""A sweep through a daemon is rejected before power is on, and its recording is checked."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cdpr_profiles import load_robot
from cdpr_rt.core.cycle_row import cycle_dtype
from cdpr_rt.identification.commissioning_results import Paths
from cdpr_tools.commission.axis_sweep import SweptAxis, write_passes
from cdpr_tools.errors import BadInputError, WorkFailedError

PROGRAMS = ["idle", "hold", "jog", "sweep", "pid"]
DRIVE = {
    "vendor_id": 1,
    "product_code": 2,
    "revision": 3,
    "serial": 4,
    "encoder_counts_per_turn": 4096,
}


class Told:
    """A stand-in for a daemon that is ready and records. `more` changes its status."""

    def __init__(self, programs: list[str], **more: Any) -> None:
        self.description = {"programs": programs, "period_s": 0.002}
        self.status = {
            "state": "ready",
            "read_only": False,
            "parts": {"recording": {"recording": True}},
            "buses": {"can0": {"url": "simbus:x", "drives": {"left": DRIVE, "right": DRIVE}}},
            **more,
        }


def swept(daemon: Told, name: str = "right", robot: str = "bench-2") -> SweptAxis:
    return SweptAxis.of(daemon.description, daemon.status, name, load_robot(robot))


def test_a_ready_daemon_provides_the_data_for_a_sweep() -> None:
    axis = swept(Told(PROGRAMS))
    assert (axis.place, axis.is_simulated, axis.identity["serial"]) == (1, True, 4)


@pytest.mark.parametrize(
    ("programs", "more", "text"),
    [
        (["idle", "hold", "lower"], {}, "motors share a platform"),
        (PROGRAMS, {"read_only": True}, "only listens"),
        (PROGRAMS, {"parts": {}}, "does not record"),
        (PROGRAMS, {"state": "active"}, "is active; allowed: ready"),
        (PROGRAMS, {"state": "fault"}, "is fault; allowed: ready"),
    ],
)
def test_a_sweep_is_rejected_with_the_reason(
    programs: list[str], more: dict[str, Any], text: str
) -> None:
    with pytest.raises(BadInputError, match=text):
        swept(Told(programs, **more))


def test_a_recording_without_all_moves_is_rejected(tmp_path: Path) -> None:
    axis = swept(Told(PROGRAMS))
    rows = np.zeros(100, cycle_dtype(2))
    rows["cycle"], rows["time_s"] = np.arange(100), np.arange(100) * 2e-3
    rows["program"] = PROGRAMS.index("sweep")
    rows["setpoint_velocity_rad_s"][10:40, axis.place] = 1.0
    with pytest.raises(WorkFailedError, match="1 of 2 sweep legs and 0 of"):
        write_passes(rows, axis, Paths(tmp_path))

"""A load cell with an offset, injected on the simulated robot, is reported in the status."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from cdpr_profiles.places import SHIPPED
from cdpr_rt.core.states import LoopState
from cdpr_tools.lockstep_robot import LockstepRobot
from tests.slower_robot import slower_robot

pytestmark = pytest.mark.long

AXIS, CELL_OFF = 1, 14


@pytest.fixture
def robot(tmp_path: Path) -> Iterator[LockstepRobot]:
    file = slower_robot(tmp_path, "planar-3")
    file.write_text('tension_sensors = "cells.toml"\n' + file.read_text())
    cells = (SHIPPED / "tension_sensors" / "rtu-load-cells-8.toml").read_text()
    parts = cells.split("[[sensors]]")
    (tmp_path / "cells.toml").write_text("[[sensors]]".join(parts[:4]))
    with LockstepRobot(file) as opened:
        opened.enable()
        opened.carry_out("tighten", 60.0)
        opened.carry_out("pose", position_m=[0.0, 1.5])
        yield opened


def notices(robot: LockstepRobot) -> list[str]:
    return [text for text in robot.status()["notices"] if "load cell" in text]


def test_an_offset_load_cell_is_reported_and_motion_continues(robot: LockstepRobot) -> None:
    robot.carry_out("pose", position_m=[0.3, 1.7])
    robot.run(6.0)
    assert not notices(robot)
    name = robot.robot.axes[AXIS].name
    robot.inject(axis=AXIS, sub=CELL_OFF, value=35)
    robot.run(6.0)
    (told,) = notices(robot)
    assert told.startswith(f"{name}: its load cell shows ")
    assert 25.0 < float(told.split(" shows ")[1].split(" N ")[0]) < 45.0
    assert " N more than its motor" in told
    robot.inject(axis=AXIS, sub=CELL_OFF, value=0)
    robot.carry_out("pose", position_m=[0.0, 1.5])
    robot.run(3.0)
    assert notices(robot) == [told], "the notice remains in the status"
    assert robot.state is LoopState.ACTIVE
    robot.carry_out("lower", 60.0)
    robot.carry_out("tighten", 60.0)
    assert not notices(robot)

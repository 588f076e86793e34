"""Drives that are in fault when the loop begins or checks: nobody is shut out for good."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from cdpr_drivers.cia402 import POWER_OFF
from cdpr_rt.core.states import LoopState
from tests.tools.daemon.loop_rig import LoopRig, opened
from tests.tools.robot_rig import robot_file, simulated

FAULT_CODE = 1
JOG = {"velocity_rad_s": [2.0, 2.0], "timeout_s": 2.0}


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Path, str]]:
    path = robot_file(tmp_path_factory.mktemp("robot"), [("can0", 1), ("can0", 2)], period_s=2e-3)
    with simulated(path) as url:
        yield path, url


def unpowered(rig: LoopRig) -> bool:
    return all(state in POWER_OFF for state in rig.machine._booted.states())


def test_a_loop_that_begins_with_a_drive_in_fault(lab: tuple[Path, str]) -> None:
    with opened(*lab) as rig:
        rig.inject_fault(0, FAULT_CODE, 0x7305)
        rig.turn_until(lambda: rig.state is LoopState.FAULT)
    with opened(*lab) as rig:
        # a start resets nothing by itself; somebody who asks for a check does
        assert rig.state is LoopState.INACTIVE
        assert "in fault" in rig.status["reason"]
        rig.obeyed("check")
        assert rig.state is LoopState.READY
        assert unpowered(rig)
        rig.obeyed("enable")


def test_a_fault_while_one_is_acknowledged(lab: tuple[Path, str]) -> None:
    with opened(*lab) as rig:
        rig.inject_fault(0, FAULT_CODE, 0x7305)
        rig.turn_until(lambda: rig.state is LoopState.FAULT and not rig.loop.busy)
        rig.block.post_command({"do": "acknowledge"})
        rig.turn_until(lambda: rig.state is LoopState.INACTIVE and rig.loop.engine.cycling)
        rig.turn(40)
        rig.inject_fault(1, FAULT_CODE, 0x7305)
        rig.turn_until(lambda: not rig.loop.busy)
        assert rig.state is LoopState.FAULT
        assert "node 2" in rig.status["reason"]
        assert rig.status["reason"].count("before") == 1
        rig.block.take_reply()
        rig.obeyed("acknowledge")
        assert rig.state is LoopState.READY
        assert unpowered(rig)


def test_a_drive_that_restarted_needs_a_new_boot(lab: tuple[Path, str]) -> None:
    with opened(*lab) as rig:
        rig.block.post_command({"do": "check"})
        rig.turn(30)
        assert rig.state is LoopState.INACTIVE
        rig.machine.networks["can0"].reset(2)
        rig.turn_until(lambda: not rig.loop.busy)
        for _ in range(2):
            answer = rig.command("check")
            assert not answer["ok"]
            assert "restarted" in answer["text"]
        rig.obeyed("configure")
        rig.obeyed("check")
        assert rig.state is LoopState.READY


def test_who_asks_for_hold_while_the_power_comes_gets_no_motion(lab: tuple[Path, str]) -> None:
    with opened(*lab) as rig:
        rig.block.post_command(
            {"do": "enable", "right": rig.right, "program": "jog", "wanted": JOG}
        )
        rig.turn(2)
        assert rig.loop.busy
        rig.obeyed("hold")
        rig.turn_until(lambda: not rig.loop.busy)
        rows = rig.run(0.3)
        assert rig.state is LoopState.ACTIVE
        assert rig.status["program"] == "hold"
        assert not rows["setpoint_velocity_rad_s"].any()
        rig.obeyed("program", program="jog", wanted=JOG)
        rig.obeyed("disable")
        rig.block.take_reply()
        rig.obeyed("enable", program="jog", wanted=JOG)
        assert rig.status["program"] == "jog"

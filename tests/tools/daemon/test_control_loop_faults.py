"""Permanent and temporary faults: a deaf drive, a lost bus, a failing program."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from cdpr_drivers.cia402 import POWER_OFF, State
from cdpr_profiles import load_robot
from cdpr_rt.core.states import LoopState
from cdpr_rt.model.robot_arrays import limits_of
from cdpr_rt.programs.idle import IdleProgram
from cdpr_rt.programs.model import model_of
from tests.tools.daemon.loop_rig import LoopRig, opened
from tests.tools.daemon.test_control_loop import PERIOD_S, SILENT_MS, drive_states
from tests.tools.robot_rig import Simulator, robot_file, simulated, unique


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Path, str]]:
    path = robot_file(
        tmp_path_factory.mktemp("robot"), [("can0", 1), ("can0", 2)], period_s=PERIOD_S
    )
    with simulated(path) as url:
        yield path, url


def test_a_deaf_drive_keeps_the_fault(lab: tuple[Path, str]) -> None:
    with simulated(lab[0]) as url, opened(lab[0], url) as rig:
        rig.inject_fault(1, SILENT_MS, 65535)
        rig.turn_until(lambda: rig.state is LoopState.FAULT)
        rig.turn_until(lambda: not rig.loop.busy)
        answer = rig.command("acknowledge")
        assert not answer["ok"]
        assert "node 2" in answer["text"]
        assert rig.state is LoopState.FAULT
        assert "axis 2: the drive (bus can0 node 2)" in rig.status["reason"]


def test_a_bus_that_returns_can_be_acknowledged(lab: tuple[Path, str]) -> None:
    name = unique()
    simulator = Simulator(str(lab[0]), "--bus", f"simbus:{name}")
    with opened(lab[0], f"simbus:{name}") as rig:
        rig.obeyed("enable")
        rig.run(0.1)
        simulator.kill()
        rig.turn_until(lambda: rig.state is LoopState.FAULT)
        rig.turn_until(lambda: not rig.loop.busy)
        assert "lost" in rig.status["reason"]
        answer = rig.command("acknowledge")
        assert not answer["ok"]
        assert rig.state is LoopState.FAULT
        with simulated(lab[0], name=name):
            rig.obeyed("acknowledge")
            assert rig.state is LoopState.READY
            rig.obeyed("enable")
            assert drive_states(rig.run(0.1)) == {State.OPERATION_ENABLED}
            rig.obeyed("disable")


def test_a_failing_program_stops_the_drives_but_not_the_loop(lab: tuple[Path, str]) -> None:
    class Failing(IdleProgram):
        name = "failing"

        def update(self, feedback: Any, setpoint: Any, torque_Nm: Any) -> None:
            raise ZeroDivisionError("by nought")

    model = model_of(load_robot(lab[0]).axes, PERIOD_S, [3e-3] * 2, limits_of(load_robot(lab[0])))
    with simulated(lab[0]) as url, opened(lab[0], url, {"failing": Failing(model)}) as rig:
        rig.obeyed("enable")
        rig.command("program", program="failing")
        rig.turn_until(lambda: rig.state is LoopState.FAULT)
        reason = rig.status["reason"]
        assert "failing: ZeroDivisionError: by nought" in reason
        rig.turn_until(lambda: not rig.loop.busy)
        assert State.OPERATION_ENABLED not in drive_states(rig.run(0.1))
        rig.obeyed("acknowledge")
        rig.obeyed("enable")


def test_the_failure_of_a_program_is_reported_until_another_program_moves(
    lab: tuple[Path, str],
) -> None:
    class Stuck(IdleProgram):
        name = "stuck"
        done = 0.0

        def progress(self) -> dict[str, Any]:
            return {"trouble": "no way on", "done": self.done}

    model = model_of(load_robot(lab[0]).axes, PERIOD_S, [3e-3] * 2, limits_of(load_robot(lab[0])))
    stuck = Stuck(model)
    with simulated(lab[0]) as url, opened(lab[0], url, {"stuck": stuck}) as rig:
        rig.obeyed("enable")
        assert rig.status["failure"] == ""
        rig.obeyed("program", program="stuck")
        assert rig.status["failure"] == "stuck: no way on"
        rig.obeyed("hold")
        rig.turn_until(lambda: rig.status["program"] == "hold")
        assert rig.status["failure"] == "stuck: no way on"
        stuck.done = 1.0  # it is complete, with a remark
        rig.obeyed("program", program="stuck")
        assert rig.status["failure"] == ""


# Drives in fault when the loop starts or checks.

FAULT_CODE = 1
JOG = {"velocity_rad_s": [2.0, 2.0], "timeout_s": 2.0}


def unpowered(rig: LoopRig) -> bool:
    return all(state in POWER_OFF for state in rig.machine._booted.states())


def test_a_loop_that_starts_with_a_drive_in_fault_is_inactive_until_checked(
    lab: tuple[Path, str],
) -> None:
    with opened(*lab) as rig:
        rig.inject_fault(0, FAULT_CODE, 0x7305)
        rig.turn_until(lambda: rig.state is LoopState.FAULT)
    with opened(*lab) as rig:
        # a start does not reset faults; a requested check does
        assert rig.state is LoopState.INACTIVE
        assert "7305h" in rig.status["reason"]
        assert rig.status["reason_limit"]["axis"] == 0
        rig.obeyed("check")
        assert rig.state is LoopState.READY
        assert unpowered(rig)
        rig.obeyed("enable")


def test_a_fault_during_an_acknowledgement_is_latched(lab: tuple[Path, str]) -> None:
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


def test_a_restarted_drive_needs_a_new_boot(lab: tuple[Path, str]) -> None:
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


def test_a_hold_while_enabling_prevents_the_requested_motion(lab: tuple[Path, str]) -> None:
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

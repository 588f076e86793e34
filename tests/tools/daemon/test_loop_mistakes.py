"""Errors in programs and status: the drives stop, and the loop continues and reports them."""

from __future__ import annotations

import io
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from cdpr_drivers.cia402 import POWER_OFF
from cdpr_drivers.robot.machine import RobotMachine
from cdpr_profiles import load_robot
from cdpr_rt.core.shared_block import SharedBlock
from cdpr_rt.core.states import LoopState, Reaction
from cdpr_rt.model.robot_arrays import limits_of
from cdpr_rt.programs.axis_program import AxisProgram
from cdpr_rt.programs.idle import IdleProgram
from cdpr_rt.programs.model import model_of
from cdpr_rt.programs.registry import build_programs
from tests.tools.daemon.loop_rig import LoopRig, opened
from tests.tools.robot_rig import robot_file, simulated

PERIOD_S = 2e-3


class Careless(AxisProgram):
    """A program that holds, but whose stop and progress raise errors."""

    name = "careless"

    def stop(self) -> None:
        raise ZeroDivisionError("by nought")

    def progress(self) -> dict[str, Any]:
        raise KeyError("done")


@pytest.fixture
def rig(tmp_path: Path) -> Iterator[LoopRig]:
    path = robot_file(tmp_path, [("can0", 1)], period_s=PERIOD_S)
    robot = load_robot(path)
    model = model_of(robot.axes, PERIOD_S, [3e-3], limits_of(robot))
    hold = build_programs(model, SharedBlock.create(1, 1.0, 500.0))["hold"]
    assert isinstance(hold, AxisProgram)
    programs = {"careless": Careless(model, hold._loop), "bare": IdleProgram(model)}
    with simulated(path) as url, opened(path, url, programs) as made:
        made.obeyed("enable", program="careless")
        yield made


def test_a_program_whose_stop_fails_loses_power(rig: LoopRig) -> None:
    answer = rig.command("disable")
    assert not answer["ok"]
    rig.turn_until(lambda: rig.state is LoopState.FAULT and not rig.loop.busy)
    assert "ZeroDivisionError: by nought" in rig.status["reason"]
    assert all(state in POWER_OFF for state in rig.machine._booted.states())
    rig.obeyed("acknowledge")


def test_a_limit_with_a_program_whose_stop_fails_causes_a_quick_stop(rig: LoopRig) -> None:
    rig.loop.safe_stop.stop(Reaction.CONTROLLED_STOP, LoopState.FAULT)
    assert rig.loop.engine.reacting is Reaction.QUICK_STOP
    assert not rig.loop.engine.driving
    rig.turn_until(lambda: rig.state is LoopState.FAULT)
    assert all(state in POWER_OFF for state in rig.machine._booted.states())


@pytest.mark.parametrize("way", ["command", "limit"])
def test_the_traceback_is_printed_after_power_is_off(
    rig: LoopRig, monkeypatch: pytest.MonkeyPatch, way: str
) -> None:
    had_power = []

    class Terminal(io.StringIO):
        def write(self, text: str) -> int:
            had_power.append(rig.loop.engine.driving)
            return super().write(text)

    monkeypatch.setattr(sys, "stderr", Terminal())
    if way == "command":
        rig.command("disable")
    else:
        rig.loop.safe_stop.stop(Reaction.CONTROLLED_STOP, LoopState.FAULT)
    assert had_power and not any(had_power)


def test_a_command_during_a_reaction_is_rejected_with_its_reason(rig: LoopRig) -> None:
    rig.loop.life.set_reason("axis 1: slack")
    rig.loop.safe_stop.stop(Reaction.CONTROLLED_STOP, LoopState.FAULT)
    answer = rig.command("hold")
    assert not answer["ok"]
    assert "the robot is stopping (axis 1: slack): " in answer["text"]


def test_a_program_whose_progress_fails_continues(rig: LoopRig) -> None:
    rig.turn(10)
    assert rig.status["program"] == "careless"
    assert "KeyError" in rig.status["program_progress"]["error"]
    rig.obeyed("hold")


@pytest.mark.parametrize("what", ["reason", "safety", "everything"])
def test_a_status_that_cannot_be_written_does_not_end_the_loop(
    rig: LoopRig, monkeypatch: pytest.MonkeyPatch, what: str
) -> None:
    before = rig.status["state"]
    if what == "reason":
        rig.loop.life.set_reason("\u00e9" * 20000)
    elif what == "safety":
        monkeypatch.setattr(RobotMachine, "safety", "x" * 20000)
    else:
        monkeypatch.setattr(rig.loop.engine.block, "_status", rig.loop.engine.block._status[:16])
    rig.loop.life.changed = True
    rig.turn(3)
    if what != "everything":
        assert rig.block.status()["state"] == before
    rig.obeyed("hold")


def test_a_long_error_of_a_program_does_not_displace_faults_in_the_status(
    rig: LoopRig, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise ValueError("\u00e9" * 20000)

    monkeypatch.setattr(rig.loop.engine.program, "update", fail)
    rig.turn_until(lambda: rig.state is LoopState.FAULT and not rig.loop.busy)
    (fault,) = rig.block.status()["faults"]
    assert fault["code"] == "program"
    assert "ValueError: \u00e9" in fault["text"]


def test_a_very_long_command_is_rejected(rig: LoopRig) -> None:
    answer = rig.command("\u00e9" * 665)
    assert not answer["ok"]
    rig.obeyed("hold")


def test_an_error_while_closing_the_machine_is_reported(
    rig: LoopRig, monkeypatch: pytest.MonkeyPatch
) -> None:
    leave = rig.machine._stack.close

    def stays_closed() -> None:
        leave()
        raise OSError("the contactor stays closed")

    rig.obeyed("hold")
    monkeypatch.setattr(rig.machine._stack, "close", stays_closed)
    assert isinstance(rig.machine, RobotMachine)
    rig.loop.request_stop()
    rig.turn_until(lambda: rig.loop.ended)
    assert "contactor" in rig.loop.transitions.power_off_unconfirmed
    assert "contactor" in rig.status["reason"]

"""Commands that need preparation, such as reading a file, are deferred until it is done."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import pytest

from cdpr_profiles.robot_limits import Limit
from cdpr_rt.core.fault import BUS_LOST, Fault
from cdpr_rt.core.states import LoopState
from cdpr_rt.model.robot_arrays import limits_of
from cdpr_rt.programs.base import ProgramError
from cdpr_rt.programs.idle import IdleProgram
from cdpr_rt.programs.model import model_of
from tests.tools.daemon.loop_rig import LoopRig, opened
from tests.tools.robot_rig import robot_file, simulated

JOG = {"velocity_rad_s": [1.0], "timeout_s": 2.0}


class Prepared(IdleProgram):
    """A program that does nothing after its request has been prepared."""

    name = "prepared"
    ready = ""

    def preparation(self, arguments: Mapping[str, Any]) -> Callable[[], None] | None:
        what = str(arguments.get("what"))
        return None if self.ready == what else lambda: self.prepare(what)

    def prepare(self, what: str) -> None:
        if what == "bad":
            raise ProgramError("what: value 'bad'")
        self.ready = what

    def check(self, arguments: Mapping[str, Any]) -> Any:
        assert self.ready == arguments["what"]


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LoopRig]:
    path = robot_file(tmp_path_factory.mktemp("robot"), [("can0", 1)])
    with simulated(path) as url, opened(path, url) as made:
        axes, period_s = made.robot.axes, made.robot.sync_period_s
        program = Prepared(model_of(axes, period_s, [0.002], limits_of(made.robot)))
        made.loop.engine.parts.programs["prepared"] = program
        made.loop.engine.programs.append(program)
        yield made


def hold(rig: LoopRig) -> None:
    """Make the robot hold with power from any state."""
    if rig.state is LoopState.READY:
        rig.obeyed("enable")
    rig.obeyed("hold")


def test_a_command_is_executed_after_its_preparation(rig: LoopRig) -> None:
    hold(rig)
    rig.obeyed("program", program="prepared", wanted={"what": "plan"})
    assert rig.loop.engine.program.name == "prepared"
    rig.obeyed("hold")


def test_a_failed_preparation_is_rejected_and_changes_nothing(rig: LoopRig) -> None:
    hold(rig)
    answer = rig.command("program", program="prepared", wanted={"what": "bad"})
    assert (answer["ok"], answer["text"]) == (False, "what: value 'bad'")
    assert rig.loop.engine.program.name == "hold"


@pytest.mark.parametrize("urgent", [False, True])
def test_another_command_cancels_a_preparation(rig: LoopRig, urgent: bool) -> None:
    hold(rig)
    asked = {"do": "program", "program": "prepared", "wanted": {"what": f"other {urgent}"}}
    number = rig.block.post_command({**asked, "right": rig.right})
    rig.turn(1)
    if urgent:
        rig.block.count_stop()
    (rig.block.post_urgent if urgent else rig.block.post_command)({"do": "hold"})
    rig.turn(20)
    answers = {answer["to"]: answer for answer in iter(rig.block.take_reply, None)}
    assert answers[number]["ok"] is False
    assert "cancelled: " in answers[number]["text"]
    assert rig.loop.engine.program.name == "hold"


def begun_in_a_jog(rig: LoopRig, what: str) -> int:
    """Jog, and post a command whose preparation takes until the next turn. Return its number."""
    hold(rig)
    rig.obeyed("program", program="jog", wanted=JOG)
    asked = {"do": "program", "program": "prepared", "wanted": {"what": what}, "right": rig.right}
    number = rig.block.post_command(asked)
    rig.turn(1)
    return number


def answer_to(rig: LoopRig, number: int) -> str:
    """Turn until a command is rejected. Return the reason."""
    rig.turn(20)
    answers = {answer["to"]: answer for answer in iter(rig.block.take_reply, None)}
    assert not answers[number]["ok"]
    return str(answers[number]["text"])


@pytest.mark.parametrize("limit", [Limit.SLACK, Limit.DRIVE])
def test_a_fault_during_preparation_cancels_it(
    rig: LoopRig, limit: Limit, monkeypatch: pytest.MonkeyPatch
) -> None:
    number = begun_in_a_jog(rig, f"with {limit}")
    supervisor = rig.loop.engine.parts.supervisor
    fault = Fault(limit, 0, BUS_LOST, detail="this was found")
    with monkeypatch.context() as found:
        found.setattr(supervisor, "check", lambda *_: supervisor.report(fault))
        rig.turn(1)
    assert answer_to(rig, number) == "cancelled: axis 1: this was found"
    rig.turn_until(lambda: not rig.loop.busy)
    assert rig.status["reason"].startswith("axis 1: this was found")
    faulty = limit is Limit.DRIVE
    assert rig.loop.engine.program.name == ("idle" if faulty else "hold")
    assert rig.state is (LoopState.FAULT if faulty else LoopState.ACTIVE)
    if faulty:
        rig.obeyed("acknowledge")


def test_losing_the_right_to_move_cancels_a_preparation(rig: LoopRig) -> None:
    number = begun_in_a_jog(rig, "without a right")
    rig.drop_right()
    rig.take_right()
    why = "jog: another client has taken the right to move; the robot holds"
    assert answer_to(rig, number) == f"cancelled: {why}"
    assert (rig.loop.engine.program.name, rig.status["reason"]) == ("hold", why)


def test_enable_gives_power_after_the_preparation(rig: LoopRig) -> None:
    rig.obeyed("disable")
    assert not rig.command("enable", program="prepared", wanted={"what": "bad"})["ok"]
    assert rig.state is LoopState.READY
    rig.obeyed("enable", program="prepared", wanted={"what": "power"})
    assert rig.loop.engine.program.name == "prepared"

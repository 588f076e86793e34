"""Stops through the service's link to the real loop precede all other commands."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import HealthCheck, given, note, settings
from hypothesis import strategies as st

from cdpr_rt.core.shared_block import MESSAGES, URGENT_MESSAGES
from cdpr_rt.core.states import LoopState
from cdpr_rt.service.link import LoopLink, Reply
from tests.tools.daemon.loop_rig import LoopRig, opened
from tests.tools.robot_rig import robot_file, simulated

PERIOD_S = 2e-3
JOG = {"program": "jog", "wanted": {"velocity_rad_s": [0.5], "timeout_s": 2.0}}
WAIT_S = 600.0


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LoopRig]:
    folder = tmp_path_factory.mktemp("robot")
    path = robot_file(folder, [("can0", 1)], period_s=PERIOD_S)
    with simulated(path) as url, opened(path, url) as made:
        yield made


@pytest.fixture
def active(rig: LoopRig) -> Iterator[LoopRig]:
    while rig.block.take_reply() is not None:
        pass
    if rig.state is LoopState.FAULT:
        rig.obeyed("acknowledge")
    if rig.state is LoopState.READY:
        rig.obeyed("enable")
    rig.turn_until(lambda: not rig.loop.busy)
    yield rig
    if rig.state is LoopState.ACTIVE:
        rig.obeyed("disable")


def test_the_status_shows_a_command_before_its_reply(
    active: LoopRig, monkeypatch: pytest.MonkeyPatch
) -> None:
    found: list[tuple[str, str]] = []
    post = active.block.post_reply

    def look_and_post(reply: dict[str, object]) -> None:
        status = active.block.status()
        found.append((status["program"], status["state"]))
        post(reply)

    monkeypatch.setattr(active.block, "post_reply", look_and_post)
    active.obeyed("program", **JOG)
    active.obeyed("hold")
    active.obeyed("disable")
    assert found[:2] == [("jog", "active"), ("hold", "active")]
    assert found[2][1] == "ready"


class Clients:
    """Clients of a link, and a loop that the test turns."""

    def __init__(self, rig: LoopRig) -> None:
        self.rig = rig
        self.link = LoopLink(rig.block)
        rig.block.counters["loop_pid"] = 0  # alive like this process
        # turned by the test
        self.link._require_loop = lambda: None  # type: ignore[method-assign]
        self.link._require_cycles = lambda: None  # type: ignore[method-assign]
        self.asked: list[tuple[str, asyncio.Task[Reply]]] = []

    async def ask(self, do: str) -> None:
        what = {**JOG, "right": self.rig.right} if do == "program" else {}
        task = asyncio.create_task(self.link.command(do, WAIT_S, client="test", **what))
        self.asked.append((do, task))
        await asyncio.sleep(0)

    async def turn(self, turns: int = 1) -> None:
        for _ in range(turns):
            self.rig.loop.turn()
        await asyncio.sleep(0)

    async def hear(self) -> None:
        self.link._take_replies()
        for _ in range(3):
            await asyncio.sleep(0)

    async def until_all_are_answered(self) -> None:
        for _ in range(20_000):
            await self.turn()
            await self.hear()
            if all(task.done() for _, task in self.asked):
                return
        raise AssertionError("not answered")


STEPS = st.lists(
    st.sampled_from(["program", "hold", "turn", "hear"]),
    min_size=4,
    max_size=25,
)


@settings(
    max_examples=100,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
@given(steps=STEPS)
def test_requests_from_before_a_stop_do_not_move_after_it(
    active: LoopRig, steps: list[str]
) -> None:
    async def play() -> None:
        clients = Clients(active)
        for step in steps:
            note(step)
            if step == "turn":
                await clients.turn()
            elif step == "hear":
                await clients.hear()
            else:
                await clients.ask(step)
        await clients.until_all_are_answered()
        asked = [do for do, _ in clients.asked]
        stops = [task.result() for do, task in clients.asked if do != "program"]
        assert all(reply.ok for reply in stops)
        if asked:
            assert active.loop.engine.program.name == ("jog" if asked[-1] == "program" else "hold")

    asyncio.run(play())


def test_a_stop_precedes_a_full_queue(active: LoopRig) -> None:
    block = active.block
    active.obeyed("program", **JOG)
    for _ in range(MESSAGES):
        block.post_command({"do": "program", "client": "test", "right": active.right, **JOG})
    block.count_stop()
    number = block.post_urgent({"do": "hold", "client": "another"})
    active.turn(1)
    assert active.loop.engine.program.name == "hold"
    answers = [block.take_reply(), block.take_reply()]
    assert answers[0] is not None
    assert (answers[0]["to"], answers[0]["ok"]) == (number, True)
    active.turn(MESSAGES)
    assert active.loop.engine.program.name == "hold"
    while (reply := block.take_reply()) is not None:
        assert "cancelled by a later stop" in reply["text"]
    active.obeyed("program", **JOG)  # later commands are accepted again
    active.obeyed("hold")


def test_thousands_of_stops_are_merged_and_all_are_answered(active: LoopRig) -> None:
    async def play() -> None:
        clients = Clients(active)
        before = int(active.block.counters["urgent"][0])
        for _ in range(50):
            for _ in range(20):
                await clients.ask("hold")
                await clients.ask("disable")
            await clients.ask("program")
            await clients.turn()
        await clients.until_all_are_answered()
        answers = [task.result() for do, task in clients.asked if do == "disable"]
        assert all(reply.ok for reply in answers)
        assert int(active.block.counters["urgent"][0]) - before <= 110

    asyncio.run(play())
    assert active.state is LoopState.READY


def test_commands_other_than_stops_are_skipped(active: LoopRig) -> None:
    block = active.block
    for data in (b"{", b"\xff\xfe", b"7", b'"hold"', b"null", b'{"do": "enable", "number": -1}'):
        number = int(block.counters["urgent"][0])
        slot = block._urgent[number % URGENT_MESSAGES]
        slot[:8].view("<u8")[0] = len(data)
        slot[8 : 8 + len(data)] = np.frombuffer(data, np.uint8)
        block.counters["urgent"][0] = number + 1
        active.turn(2)
        assert block.counters["urgent_taken"][0] == number + 1
    assert active.loop.engine.program.name == "hold"


def test_repeated_holds_do_not_move_the_set_point(active: LoopRig) -> None:
    active.obeyed("program", **JOG)
    active.run(0.2)
    active.obeyed("hold")
    active.run(0.5)
    setpoint = active.loop.engine.setpoint.position_rad.copy()
    for _ in range(50):
        active.obeyed("hold")
    assert active.loop.engine.setpoint.position_rad == pytest.approx(setpoint, abs=1e-12)

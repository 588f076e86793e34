"""The loop's states, commands and stops, on simulated drives in lockstep."""

from __future__ import annotations

import gc
import json
import struct
import tracemalloc
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cdpr_drivers.cia402 import STATE_TABLE, State
from cdpr_rt.core.cycle_row import Row
from cdpr_rt.core.states import EMERGENCY_STOP, LoopState
from cdpr_rt.refusal import CommandRefusal
from tests.drivers.bus_log import BusLog, logged
from tests.tools.daemon.loop_rig import LoopRig, opened
from tests.tools.robot_rig import robot_file, simulated

PERIOD_S = 2e-3
FAULT_CODE, SILENT_MS = 1, 6
QUICK_STOP_WORD = 0x02


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Path, str]]:
    path = robot_file(
        tmp_path_factory.mktemp("robot"), [("can0", 1), ("can0", 2)], period_s=PERIOD_S
    )
    with simulated(path) as url:
        yield path, url


@pytest.fixture(scope="module")
def rig(lab: tuple[Path, str]) -> Iterator[LoopRig]:
    with opened(*lab) as made:
        yield made


@pytest.fixture
def ready(rig: LoopRig) -> Iterator[LoopRig]:
    assert rig.state is LoopState.READY, rig.status
    yield rig
    if rig.state is LoopState.ACTIVE:
        rig.obeyed("disable")
    if rig.state is LoopState.FAULT:
        rig.obeyed("acknowledge")


@pytest.fixture
def jogging(ready: LoopRig) -> LoopRig:
    """Return a loop that moves both axes at 2 rad/s."""
    ready.obeyed("enable")
    ready.obeyed("program", program="jog", wanted=JOG)
    ready.run(0.4)
    assert ready.loop.engine.setpoint.velocity_rad_s == pytest.approx([2.0, 2.0])
    return ready


JOG = {"velocity_rad_s": [2.0, 2.0], "timeout_s": 2.0}


def log_of(rig: LoopRig) -> Any:
    (url,) = rig.machine._urls.values()
    return logged(str(url))


def drive_states(rows: Row) -> set[State]:
    return {State(int(s)) for s in np.unique(STATE_TABLE[rows["statusword"] & 0x7F])}


def controlwords(log: BusLog, node: int) -> list[tuple[int, int]]:
    """Return cycle and controlword of each command to a drive."""
    return [(f.cycle, struct.unpack_from("<H", f.data)[0]) for f in log.of(0x200 + node)]


def test_the_loop_is_ready_without_power_after_its_start(ready: LoopRig) -> None:
    rows = ready.run(0.5)
    assert drive_states(rows) <= {State.SWITCH_ON_DISABLED, State.READY}
    assert np.all(rows["state"] == LoopState.READY)
    assert np.all(rows["answered"] == 2)
    assert np.all(rows["torque_sent_Nm"] == 0.0)
    assert np.all(np.diff(rows["cycle"].astype(int)) == 1)
    np.testing.assert_allclose(np.diff(rows["time_s"]), PERIOD_S)
    status = ready.status
    assert (status["state"], status["reason"], status["program"]) == ("ready", "", "idle")
    assert status["check"]["missed"] == 0
    assert status["lockstep"] is True


def test_enable_holds_and_disable_cuts_power(ready: LoopRig) -> None:
    ready.obeyed("enable")
    rows = ready.run(0.5)
    assert drive_states(rows) == {State.OPERATION_ENABLED}
    assert ready.status["program"] == "hold"
    assert np.ptp(rows["setpoint_rad"][:, 0]) == 0.0
    assert np.max(np.abs(rows["position_rad"] - rows["setpoint_rad"])) < 0.02
    assert np.max(np.abs(rows["torque_sent_Nm"])) > 0.0
    ready.obeyed("disable")
    rows = ready.run(0.1)
    assert ready.state is LoopState.READY
    assert drive_states(rows) <= {State.SWITCH_ON_DISABLED, State.READY}
    assert np.all(rows["torque_sent_Nm"] == 0.0)


def test_enable_without_the_right_to_move_is_rejected(ready: LoopRig) -> None:
    ready.drop_right()
    try:
        for order in ({"do": "enable"}, {"do": "enable", "program": "jog"}):
            answer = ready.command(**order)
            assert not answer["ok"]
            assert "right to move" in answer["text"]
        assert ready.state is LoopState.READY
    finally:
        ready.take_right()


def test_a_lease_that_expires_in_motion_ends_with_a_hold(jogging: LoopRig) -> None:
    try:
        jogging.drop_right()
        rows = jogging.run(1.0)
        assert jogging.state is LoopState.ACTIVE
        status = jogging.status
        assert status["program"] == "hold"
        assert "right to move" in status["reason"]
        assert rows["setpoint_velocity_rad_s"][-1] == pytest.approx([0.0, 0.0])
        jogging.obeyed("hold")  # allowed without the right
        assert not jogging.command("set", wanted={})["ok"]
    finally:
        jogging.take_right()


def test_program_changes_cause_no_step(ready: LoopRig) -> None:
    ready.obeyed("enable")
    ready.run(0.2)
    ready.rows()
    for name, wanted in (
        ("jog", JOG),
        ("hold", {}),
        ("jog", {"velocity_rad_s": [-3.0, 1.0], "timeout_s": 2.0}),
        ("pid", {"distance_rad": [1.0, -1.0]}),
        ("jog", JOG),
    ):
        ready.obeyed("program", program=name, wanted=wanted)
        ready.turn(100)
    rows = ready.rows()
    assert len(np.unique(rows["program"])) == 3
    velocity = rows["setpoint_velocity_rad_s"]
    np.testing.assert_allclose(
        np.diff(rows["setpoint_rad"], axis=0), PERIOD_S * velocity[1:], atol=5e-4
    )
    switched = np.flatnonzero(np.diff(rows["program"].astype(int)))
    step = np.abs(np.diff(rows["torque_sent_Nm"], axis=0))
    assert len(switched) == 5
    assert np.max(step[switched]) < 0.5


def test_each_cycle_has_exactly_one_command_per_drive(ready: LoopRig) -> None:
    with log_of(ready) as log:
        ready.obeyed("enable")
        ready.obeyed("program", program="jog", wanted=JOG)
        ready.run(0.1)
        ready.obeyed("disable")
        ready.obeyed("enable", program="jog", wanted=JOG)
        ready.run(0.2)
        ready.inject_fault(0, FAULT_CODE, 0x7305)
        ready.turn_until(lambda: ready.state is LoopState.FAULT)
        ready.run(0.1)
    for node in (1, 2):
        each = Counter(cycle for cycle, _ in controlwords(log, node))
        assert len(each) > 200
        assert set(each.values()) == {1}


def test_an_emergency_stop_cuts_power_in_the_next_cycle_and_latches(jogging: LoopRig) -> None:
    with log_of(jogging) as log:
        jogging.loop.request_power_off()
        jogging.turn(2)
        assert not jogging.loop.engine.driving
    words = [word for _, word in controlwords(log, 1)]
    assert words[-1] & 0x0F == 0  # "disable voltage", without quick stop or braking before
    jogging.turn_until(lambda: jogging.state is LoopState.FAULT and not jogging.loop.busy)
    assert jogging.status["reason"] == "emergency stop by cdpr estop"
    assert not jogging.command("enable")["ok"]
    jogging.obeyed("acknowledge")


def test_an_emergency_stop_without_power_latches_in_each_state(ready: LoopRig) -> None:
    ready.loop.request_power_off()
    ready.turn_until(lambda: ready.state is LoopState.FAULT and not ready.loop.busy)
    ready.loop.request_power_off()  # already latched
    ready.turn(5)
    number = ready.block.post_command({"do": "acknowledge", "client": "test"})
    ready.turn(1)
    ready.loop.request_power_off()  # during the acknowledgement
    ready.turn_until(lambda: ready.block.take_reply() is not None)
    ready.turn_until(lambda: ready.state is LoopState.FAULT and not ready.loop.busy)
    assert ready.status["reason"] == "emergency stop by cdpr estop"
    assert number
    ready.obeyed("acknowledge")


def test_released_buses_are_closed_and_an_emergency_stop_is_then_only_reported(
    ready: LoopRig,
) -> None:
    ready.obeyed("enable")
    assert not ready.command("release")["ok"]  # with power
    ready.obeyed("disable")
    ready.obeyed("release")
    assert ready.state is LoopState.UNCONFIGURED
    assert ready.machine.device is None
    assert ready.status["released"]
    assert "procedure" in ready.status["reason"]
    ready.loop.request_power_off()  # whoever has the buses must obey it
    ready.turn(2)
    assert ready.state is LoopState.UNCONFIGURED
    assert ready.status["reason"] == EMERGENCY_STOP
    ready.obeyed("configure")
    ready.obeyed("check")
    assert ready.status["reason"] == ""
    assert not ready.status["released"]


def test_a_stop_cancels_the_reading_of_an_object(ready: LoopRig) -> None:
    ready.obeyed("enable")
    reading = {"do": "object", "client": "test", "axis": 0, "index": 0x1008, "sub": 0}
    number = ready.block.post_command(reading)
    ready.turn(1)
    ready.block.post_urgent({"do": "disable", "client": "test"})
    replies: dict[int, str] = {}

    def both_answered() -> bool:
        if (reply := ready.block.take_reply()) is not None:
            replies[reply["to"]] = reply["text"]
        return len(replies) == 2

    ready.turn_until(both_answered)
    assert replies.pop(number).startswith("object: cancelled: the robot is stopping")
    assert list(replies.values()) == [""]
    assert ready.command("object", **{key: reading[key] for key in ("axis", "index", "sub")})["ok"]


def test_objects_are_read_with_power_and_written_without_but_never_a_controlword(
    ready: LoopRig,
) -> None:
    torque_limit = {"axis": 0, "index": 0x6072, "sub": 0}
    ready.obeyed("enable")
    before = ready.command("object", **torque_limit)
    assert before["ok"]
    assert "without power only" in ready.command("object", **torque_limit, value=300)["text"]
    ready.obeyed("disable")
    for index in (0x6040, 0x6840):
        refused = ready.command("object", axis=0, index=index, sub=0, value=0xF)
        assert "could switch a drive on" in refused["text"]
    ready.drop_right()
    assert not ready.command("object", **torque_limit, value=300)["ok"]
    ready.take_right()
    ready.obeyed("object", **torque_limit, value=300)
    assert ready.state is LoopState.READY
    assert ready.command("object", **torque_limit)["text"] == before["text"]  # as booted


def test_a_drive_fault_quick_stops_the_other_drives_and_latches(jogging: LoopRig) -> None:
    with log_of(jogging) as log:
        jogging.inject_fault(0, FAULT_CODE, 0x7305)
        jogging.rows()
        jogging.turn_until(lambda: jogging.state is LoopState.FAULT)
    words = controlwords(log, 2)
    fault = next(f.cycle for f in log.of(0x081))
    stopped = next(cycle for cycle, word in words if word & 0x0F == QUICK_STOP_WORD)
    assert stopped <= fault + 2
    rows = jogging.rows()
    assert State.QUICK_STOP in drive_states(rows)
    # the healthy drive stopped under power along its ramp, without coasting
    velocity = rows["velocity_rad_s"][:, 1]
    assert abs(velocity[-1]) < 1.0
    status = jogging.status
    assert "node 1" in status["reason"]
    assert "7305h" in status["reason"]
    assert status["reason_limit"]["limit"] == "drive"
    assert status["reason_limit"]["reaction"] == "quick stop"
    assert not jogging.command("enable")["ok"]
    jogging.run(1.0)
    assert jogging.state is LoopState.FAULT
    jogging.obeyed("acknowledge")
    assert jogging.state is LoopState.READY
    assert jogging.status["reason"] == ""
    rows = jogging.run(0.5)
    assert State.OPERATION_ENABLED not in drive_states(rows)
    jogging.obeyed("enable")


def test_a_silent_drive_is_booted_again_on_acknowledge(jogging: LoopRig) -> None:
    jogging.inject_fault(1, SILENT_MS, 100)
    jogging.turn_until(lambda: jogging.state is LoopState.FAULT)
    assert "node 2" in jogging.status["reason"]
    jogging.run(0.1)  # until it answers again
    jogging.turn_until(lambda: not jogging.loop.busy)
    cycle = jogging.loop.engine.cycle
    jogging.obeyed("acknowledge")
    assert jogging.state is LoopState.READY
    assert jogging.loop.engine.cycle is not cycle or jogging.machine.intact()
    jogging.obeyed("enable")
    assert drive_states(jogging.run(0.1)) == {State.OPERATION_ENABLED}


def test_arbitrary_commands_neither_crash_the_loop_nor_give_power(ready: LoopRig) -> None:
    @settings(
        max_examples=4,
        suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
    )
    @given(st.lists(st.dictionaries(KEYS, JUNK, min_size=1), min_size=30, max_size=30))
    def post(orders: list[dict[str, Any]]) -> None:
        if (
            ready.state is LoopState.FAULT
        ):  # the drives missed the master while examples were generated
            ready.obeyed("acknowledge")
        for order in orders:
            what = {key: value for key, value in order.items() if key != "do"}
            answer = ready.command(order.get("do"), **what)
            refusal = set() if answer["ok"] else {"refusal"}
            assert set(answer) - refusal == {"to", "ok", "text", "state", "number"}
            if order.get("do") == "enable" and answer["ok"]:
                ready.obeyed("disable")
            assert not ready.loop.engine.driving
        assert State.OPERATION_ENABLED not in drive_states(ready.run(0.02))

    post()


def test_a_rejection_has_a_code_and_figures(ready: LoopRig) -> None:
    answer = ready.command("program", program="jog", wanted=JOG)
    assert answer["text"] == "jog: not allowed in state ready; allowed in active"
    assert answer["refusal"] == {
        "code": "not_in_state",
        "command": "jog",
        "asked": {},
        "arguments": {"state": "ready", "allowed": ["active"]},
    }
    ready.obeyed("enable")
    answer = ready.command("program", program="jog", wanted={"velocity_rad_s": [0.0, 1e6]})
    refusal = answer["refusal"]
    assert refusal["code"] == "out_of_range" and refusal["asked"] == {"velocity_rad_s": 1e6}
    assert refusal["arguments"]["index"] == 1
    assert 0.0 < refusal["arguments"]["high"] == -refusal["arguments"]["low"] < 1e6
    assert str(CommandRefusal.from_json(refusal)) == answer["text"]
    answer = ready.command("program", program="jog", wanted={"velocity_rad_s": [0.0]})
    assert not answer["ok"] and "refusal" not in answer


def test_invalid_commands_are_ignored(ready: LoopRig) -> None:
    block = ready.block
    for data in (b"{", b"\xff\xfe", b"[" * 4000, b"7", b'"enable"', b"null"):
        number = int(block.counters["commands"][0])
        slot = block._commands[number % len(block._commands)]
        slot[:8].view("<u8")[0] = len(data)
        slot[8 : 8 + len(data)] = np.frombuffer(data, np.uint8)
        block.counters["commands"][0] = number + 1
        ready.turn(2)
        assert block.counters["commands_taken"][0] == number + 1
    assert ready.command("set", wanted={})["ok"] is False


def test_status_is_plain_json(ready: LoopRig) -> None:
    ready.obeyed("enable")
    ready.run(1.2)
    status = ready.status
    assert json.loads(json.dumps(status)) == status
    assert status["count"]["cycles"] > 0
    assert set(status["buses"]) == {"can0"}


NAMES = st.sampled_from(
    ["configure", "check", "enable", "acknowledge", "program", "set", "hold", "jog", "x"]
)
KEYS = st.sampled_from(["do", "program", "wanted", "client", "number", "velocity_rad_s"])
LEAVES = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5) | NAMES
JUNK = st.recursive(
    LEAVES,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(KEYS, inner, max_size=3),
    max_leaves=5,
)


def test_cycles_keep_no_allocated_memory(ready: LoopRig) -> None:
    ready.obeyed("enable", program="jog", wanted=JOG)
    ready.turn(500)
    gc.collect()
    tracemalloc.start()
    try:
        ready.turn(500)
        before, _ = tracemalloc.get_traced_memory()
        ready.turn(3000)
        after, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert after - before < 16_384  # the last written status
    assert peak - before < 65_536
    assert gc.collect() == 0  # no garbage, so that the collector may stay off

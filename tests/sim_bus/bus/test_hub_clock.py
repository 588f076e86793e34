"""Bus time, and bus load relative to it."""

from __future__ import annotations

import time
from collections.abc import Callable

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdpr_sim_bus.bus.client import BusLoad
from cdpr_sim_bus.clock import HOLD_S, BusClock, ClockMode
from cdpr_sim_bus.frame import LONGEST_FRAME_BITS, pack_frame

LAW = settings(max_examples=100)


def test_lockstep_time_stands_still_unless_running() -> None:
    clock = BusClock(ClockMode.LOCKSTEP, 0.0)
    assert clock.now(9.0) == clock.peek(10.0) == 0.0
    clock.run(20.0)
    assert clock.now(20.5) == pytest.approx(0.5)
    clock.stop(21.0)
    assert clock.now(30.0) == pytest.approx(1.0)
    assert clock.sync(31.0, 0.25) == clock.now(90.0) == pytest.approx(1.25)
    assert clock.sync(91.0, 0.0) == pytest.approx(1.25)
    clock.move(2.0)
    clock.run(100.0)
    clock.run(200.0)
    assert clock.now(201.0) == pytest.approx(103.0)


def test_stopping_the_clock_ends_a_hold() -> None:
    clock = BusClock(ClockMode.LOCKSTEP, 0.0)
    clock.run(0.0)
    held = clock.sync(1.0, 0.001)
    clock.stop(1.1)
    clock.run(5.0)
    assert clock.now(5.25) == pytest.approx(held + 0.25)


def test_time_runs_again_half_a_second_after_the_last_sync() -> None:
    clock = BusClock(ClockMode.LOCKSTEP, 0.0)
    clock.run(0.0)
    held = clock.sync(10.0, 0.001)
    assert clock.wall_wait(10.2, 99.0) == pytest.approx(HOLD_S - 0.2)
    assert clock.now(10.0 + HOLD_S) == pytest.approx(held)
    assert clock.now(10.0 + HOLD_S + 2.0) == pytest.approx(held + 2.0)
    assert clock.sync(10.0 + HOLD_S + 3.0, 0.001) == pytest.approx(held + 3.001)


def test_lockstep_without_a_cycle_period_follows_wall_time() -> None:
    clock = BusClock(ClockMode.LOCKSTEP, 0.0)
    clock.run(0.0)
    assert clock.sync(4.0, 0.0) == pytest.approx(4.0)
    assert not clock.held
    assert clock.now(5.0) == pytest.approx(5.0)


@given(
    st.sampled_from(ClockMode),
    st.lists(
        st.tuples(st.floats(0.0, 1.5), st.sampled_from([None, 0.0, 0.001, 0.01, "stop", "run"]))
    ),
)
@LAW
def test_bus_time_never_decreases(
    mode: ClockMode, steps: list[tuple[float, float | str | None]]
) -> None:
    clock = BusClock(mode, 7.0)
    wall, before = 7.0, 0.0
    for pause, period in steps:
        wall += pause
        if isinstance(period, float):
            now = clock.sync(wall, period)
        else:
            if period is not None and mode is ClockMode.LOCKSTEP:
                getattr(clock, period)(wall)
            now = clock.now(wall)
        assert now >= before
        assert clock.now(wall) == now
        before = now


def test_lockstep_cycle_that_does_not_fit_is_an_overrun() -> None:
    load = BusLoad(1_000_000, lockstep=True)
    load.sync(0.001)
    for bits, expected in ((1000, 0), (1001, 1), (500, 1), (2500, 2)):
        load.cycle_bits += bits
        load.sync(0.001 + 0.001 * (1 + [1000, 1001, 500, 2500].index(bits)))
        assert load.overruns == expected
    assert load.peak_cycle_load == pytest.approx(2.5)
    assert load.load(0.005) == pytest.approx(5001 / 5000)


def test_acyclic_frames_load_the_bus_but_cause_no_overrun() -> None:
    load = BusLoad(1_000_000, lockstep=True)
    load.sync(0.001)
    load.acyclic_bits += 5000
    load.sync(0.002)
    assert load.overruns == 0
    assert load.load(0.01) == pytest.approx(0.5)


@pytest.mark.parametrize(("can_id", "overruns"), [(0x581, 0), (0x601, 0), (0x7E5, 0), (0x481, 1)])
def test_sdo_between_two_syncs_waits_for_gaps(
    start_bus: Callable[..., object], stub_node: type, can_id: int, overruns: int
) -> None:
    """Twenty frames of 135 us do not fit into 1 ms, but only matter if they have priority."""
    node = stub_node(1, sync_period_s=0.001)
    member = start_bus(node).join()  # type: ignore[attr-defined]
    member.send(0x80)
    for _ in range(20):
        member.send(can_id, bytes(8))
    member.send(0x80)
    assert member.status()["overruns"] == overruns


@given(st.lists(st.integers(55, 160), max_size=40), st.integers(1, 3000))
@LAW
def test_paced_overrun_when_the_wire_is_still_busy(sizes: list[int], period_us: int) -> None:
    load = BusLoad(1_000_000, lockstep=False)
    load.sync(1.0)
    for bits in sizes:
        load.occupy(1.0, bits)
    load.sync(1.0 + period_us * 1e-6)
    backlog_us = sum(sizes) - period_us - LONGEST_FRAME_BITS
    if backlog_us != 0:
        assert load.overruns == (backlog_us > 0)


@pytest.mark.parametrize("fits", [True, False])
def test_hub_reports_an_overrun_of_eight_drives_at_1_ms(
    start_bus: Callable[..., object], stub_node: type, fits: bool
) -> None:
    """At 1 Mbit/s, 1895 us of frames fit into 2 ms but not into 1 ms."""
    nodes = [
        stub_node(
            n,
            sync_period_s=0.002 if fits else 0.001,
            answers=(pack_frame(0x180 + n, bytes(8)),),
            accepts=frozenset((0x80, 0x200 + n)),
        )
        for n in range(1, 9)
    ]
    member = start_bus(*nodes).join()  # type: ignore[attr-defined]
    for _ in range(10):
        for n in range(1, 9):
            member.send(0x200 + n, bytes(4))
        member.send(0x80)
        assert [member.recv_id() for _ in range(8)] == [0x180 + n for n in range(1, 9)]
    status = member.status()
    assert status["sync_count"] == 10
    assert status["frames"] == 10 * 17
    assert status["overruns"] == (0 if fits else 9)
    assert status["peak_cycle_load"] == pytest.approx(0.9475 if fits else 1.895)


def test_a_timer_due_between_two_syncs_sends_before_the_second(
    start_bus: Callable[..., object], stub_node: type
) -> None:
    node = stub_node(5, sync_period_s=0.01, answers=(pack_frame(0x185),))
    bus = start_bus(node)
    member, watcher = bus.join(), bus.join()  # type: ignore[attr-defined]
    member.send(0x80)
    assert member.recv_id() == 0x185
    node.timers.append(node.advanced[-1] + 0.005)
    member.send(0x80)
    assert [watcher.recv_id() for _ in range(5)] == [0x80, 0x185, 0x705, 0x80, 0x185]


def test_paced_timers_follow_wall_time(start_bus: Callable[..., object], stub_node: type) -> None:
    node = stub_node(3, sync_period_s=0.001)
    member = start_bus(node, mode=ClockMode.PACED).join()  # type: ignore[attr-defined]
    before_s = time.monotonic()
    start = member.status()["bus_time_s"]
    begun_s = time.monotonic()
    assert isinstance(start, float)
    node.timers.extend(start + 0.05 + 0.0025 * k for k in range(1, 41))
    member.send(0x80)
    for _ in range(40):
        assert member.recv_id() == 0x703
    assert time.monotonic() - before_s >= 0.15
    end_s = time.monotonic()
    passed_s = member.status()["bus_time_s"] - start
    assert end_s - begun_s <= passed_s <= time.monotonic() - before_s

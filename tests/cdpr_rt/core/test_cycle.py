"""The start times of cycles."""

from __future__ import annotations

from typing import cast

import pytest
from typing_extensions import override

from cdpr_rt.core.clock import PacedClock
from cdpr_rt.core.cycle import Cycle
from cdpr_rt.core.exchange import AxisDevice

PERIOD_S, COMMANDS_S = 2e-3, 0.8e-3


class SteppedClock(PacedClock):
    """A clock that advances only by used time and exact sleeps."""

    def __init__(self) -> None:
        super().__init__()
        self.time_s = 50.0

    @property
    @override
    def now_s(self) -> float:
        return self.time_s

    @override
    def sleep_until(self, until_s: float) -> None:
        self.time_s = max(self.time_s, until_s)


class Drives:
    """Drives with an answer time, to which `computing_s` is added."""

    period_s, commands_s, lockstep = PERIOD_S, COMMANDS_S, False

    def __init__(self) -> None:
        self.clock = SteppedClock()
        self.computing_s = 0.0
        self.synced_s: list[float] = []
        self.sent_s: list[float] = []

    def sync(self) -> None:
        self.synced_s.append(self.clock.time_s)

    def receive(self) -> int:
        self.clock.time_s += 1.1e-3 + self.computing_s
        return 0

    def transmit(self, _and_sync: bool = False) -> None:
        self.sent_s.append(self.clock.time_s)


def synced(computing_s: list[float]) -> tuple[Drives, Cycle]:
    drives = Drives()
    cycle = Cycle(cast(AxisDevice, drives))
    for drives.computing_s in computing_s:
        cycle.exchange()
        cycle.transmit()
    return drives, cycle


def test_cycles_begin_a_period_apart() -> None:
    drives, cycle = synced([0.0] * 5)
    assert drives.synced_s == pytest.approx([50.0 + k * PERIOD_S for k in range(5)])
    assert cycle.lateness.late == 0


def test_sync_is_not_sent_while_commands_are_on_the_wire() -> None:
    late_s = 0.25e-3
    drives, cycle = synced([0.0, late_s, 0.0, 0.0, 0.0])
    for sync_s, sent_s in zip(drives.synced_s[1:], drives.sent_s[:-1], strict=True):
        assert sync_s >= sent_s + COMMANDS_S - 1e-12
    behind_s = 1.1e-3 + late_s + COMMANDS_S - PERIOD_S
    # delays are caught up in the free time of cycles, and deadlines do not change
    assert drives.synced_s[2] == pytest.approx(50.0 + 2 * PERIOD_S + behind_s)
    assert drives.synced_s[4] == pytest.approx(50.0 + 4 * PERIOD_S)
    assert cycle.lateness.worst_s == pytest.approx(behind_s)


def test_the_rate_is_kept_if_commands_are_late_in_each_cycle() -> None:
    drives, cycle = synced([0.4e-3] * 100)
    behind_s = drives.synced_s[-1] - (50.0 + 99 * PERIOD_S)
    assert behind_s == pytest.approx(0.25 * PERIOD_S)
    assert cycle.late_s == pytest.approx(behind_s)


def test_a_cycle_starts_immediately_after_a_pause() -> None:
    drives, cycle = synced([0.0])
    cycle.begin()
    drives.clock.time_s += 0.01
    before_s = drives.clock.time_s
    cycle.exchange()
    assert drives.synced_s[-1] == before_s
    assert cycle.late_s == 0.0

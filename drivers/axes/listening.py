"""Axes that another master runs: this process receives their feedback and sends no frame."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from cdpr_drivers.axes import axis_codec as codec
from cdpr_drivers.axes.axis_buses import AxisReordering, placed
from cdpr_drivers.axes.axis_group import StateArrays, axis_faults
from cdpr_drivers.axes.axis_layout import AxisConfig, GroupLayout
from cdpr_drivers.bus import BusHealth, BusUrl, FrameBuffer, open_port
from cdpr_drivers.cia402 import STATE_TABLE, State
from cdpr_profiles import Winch
from cdpr_rt.arrays import BoolArray
from cdpr_rt.core.clock import PacedClock
from cdpr_rt.core.exchange import AxisCommand, AxisFeedback
from cdpr_rt.core.fault import Fault

_SYNC_ID = 0x080
_SYNC_HEAD = bytes([_SYNC_ID, 0, 0, 0])
_SYNC_WAIT_S = 0.05
"""Longest wait for SYNC; after it the cycle ends without one."""
_PAUSE_S = 0.5
"""After this time without a SYNC, the next one clears the alarms."""
_ANSWER_SHARE = 1.0
_LOCKSTEP_ANSWER_S = 0.2
_SETTLE_SHARE = 0.25
"""Time after a cycle's answers by which its SYNC has been on all buses, as a share of the period.
"""
_LOCKSTEP_SETTLE_S = 0.005
_MOST_CYCLES_AHEAD = 8
_FRAMES_PER_AXIS, _SPARE_FRAMES = 8, 64
_OTHER_MASTERS_ALARMS = codec.WRONG_MODE | codec.LEFT_ENABLED
"""Alarms about states and modes; ignored, because the other master commands them."""


@dataclass(frozen=True)
class MonitoredBus:
    """The axes on one bus, and their numbers in the whole device, 0 to n - 1."""

    name: str
    url: BusUrl
    axes: Sequence[AxisConfig]
    axis_numbers: Sequence[int]


def monitored_axis(winch: Winch, node_id: int, name: str = "") -> AxisConfig:
    """Return the axis of a drive that cannot be queried, from its profiles alone."""
    motor = winch.motor
    torque_Nm = motor.rated_torque_Nm
    counts = winch.encoder_counts_per_turn
    constant = motor.torque_constant_Nm_per_Arms
    return AxisConfig(node_id, winch.drive, torque_Nm, counts, 0, torque_Nm, constant, name)


class ListeningDevice:
    """n axes on several buses, receive-only; implements `cdpr_rt.core.exchange.AxisDevice`.

    Time comes from the SYNC of the master that runs them: `sync` waits for the next one, up to
    0.05 s. The cycles of further buses are matched to those of the first, and matched again
    after lost cycles. Torques use the unit of the profiles, because the drives are not asked
    for their rated torque.

    Raises BusError if a bus cannot be opened, and DriverError for a PDO map that does not support
    torque control.
    """

    lockstep = True
    """The next cycle begins with the other master's SYNC, not at a deadline of this process."""
    commands_s = 0.0
    """It sends no commands."""

    def __init__(self, buses: Sequence[MonitoredBus], period_s: float, clock: PacedClock) -> None:
        self.buses = tuple(buses)
        self.period_s = period_s
        self.clock = clock
        order = [number for bus in buses for number in bus.axis_numbers]
        self.n = len(order)
        arrays = StateArrays(self.n)
        self._monitors: list[_BusMonitor] = []
        first = 0
        try:
            for bus in buses:
                view = arrays.view(first, first + len(bus.axes))
                self._monitors.append(_BusMonitor(bus, period_s, view, clock))
                first += len(bus.axes)
        except BaseException:
            self.close()
            raise
        self.feedback: AxisFeedback = arrays.feedback
        self.command: AxisCommand = arrays.command
        self._reordering = AxisReordering(order, self.feedback, self.command)
        if self._reordering.needed:
            self.feedback, self.command = self._reordering.feedback, self._reordering.command
        self._columns = np.argsort(np.array(order, np.intp))
        lockstep = any(monitor.lockstep for monitor in self._monitors)
        self._settle_s = max(_SETTLE_SHARE * period_s, _LOCKSTEP_SETTLE_S if lockstep else 0.0)
        self._cycles_ahead = 0
        self._synced = False
        self._last_sync_s = -math.inf  # no master yet

    @property
    def silent_s(self) -> float:
        """Return the time since the last SYNC."""
        return self.clock.now_s - self._last_sync_s

    # -- one cycle

    def sync(self) -> None:
        """Wait for the SYNC of the other master; raises BusError if a bus is gone."""
        first, *others = self._monitors
        if others:
            self._align_buses()
        self._synced = first.await_sync(self.clock.now_s + _SYNC_WAIT_S)
        if not self._synced:
            for monitor in self._monitors:
                monitor.valid.fill(False)
            return
        now = self.clock.now_s
        if now - self._last_sync_s > _PAUSE_S:
            self.forget_alarms()
        self._last_sync_s = now
        for monitor in others:
            monitor.await_sync(now + monitor.wait_s)
        self.feedback.cycle += 1
        self.feedback.time_s = self.feedback.cycle * self.period_s

    def receive(self) -> int:
        """Receive the answers to the SYNC; return how many axes answered. Raises BusError."""
        answered = 0
        if self._synced:
            for monitor in self._monitors:
                answered += monitor.collect_answers(self.clock.now_s + monitor.wait_s)
                monitor.end_cycle()
        if self._reordering.needed:
            self._reordering.gather()
        return answered

    def _align_buses(self) -> None:
        """Skip a cycle on the buses that stay ahead because the others have lost one.

        It waits for several cycles, because SYNC does not arrive on all buses at the same instant.
        """
        deadline_s = self.clock.now_s + self._settle_s
        ahead = [monitor for monitor in self._monitors if monitor.sync_waiting(deadline_s)]
        if 0 < len(ahead) < len(self._monitors):  # the other SYNCs may just be arriving
            deadline_s = self.clock.now_s + self._settle_s
            ahead = [monitor for monitor in self._monitors if monitor.sync_waiting(deadline_s)]
        self._cycles_ahead += 1 if 0 < len(ahead) < len(self._monitors) else -1
        self._cycles_ahead = max(self._cycles_ahead, 0)
        if self._cycles_ahead >= _MOST_CYCLES_AHEAD:
            self._cycles_ahead = 0
            for monitor in ahead:
                monitor.skip_cycle()

    def transmit(self, _and_sync: bool = False) -> None:
        """Send nothing, regardless of `command`."""
        self.command.sent_torque_Nm.fill(0.0)

    def faults(self) -> tuple[Fault, ...]:
        """Return the faults of the axes, as far as their frames show them.

        A missing master is not a fault; see `silent_s`.
        """
        found: tuple[Fault, ...] = ()
        for monitor, bus in zip(self._monitors, self.buses, strict=True):
            if monitor.alarms:
                faults = axis_faults(monitor.axes, monitor.ints)
                found += placed(faults, bus.name, bus.axis_numbers)
        return found

    def forget_alarms(self) -> None:
        """Forget latched alarms."""
        for monitor in self._monitors:
            monitor.forget_alarms()

    # -- what the frames show of the axes

    def states(self) -> list[State]:
        """Return the last state that each axis reported."""
        return [State(int(state)) for state in self._row(codec.STATE)]

    def faulted(self) -> BoolArray:
        """Return which axes have been in fault since alarms were forgotten, (n,)."""
        return np.asarray(self._row(codec.FAULTED) != 0)

    @property
    def missed(self) -> int:
        """Number of answers, over all axes, that have not arrived since the start."""
        return int(sum(monitor.ints[codec.MISSED].sum() for monitor in self._monitors))

    def _row(self, row: int) -> codec.Ints:
        return np.concatenate([monitor.ints[row] for monitor in self._monitors])[self._columns]

    # -- the end

    def close(self) -> str:
        """Leave the buses; return an empty text, because no drive needs to be switched off."""
        for monitor in self._monitors:
            monitor.close()
        return ""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class _BusMonitor:
    """Receives the frames of one bus and keeps the state of its axes."""

    def __init__(
        self, bus: MonitoredBus, period_s: float, arrays: StateArrays, clock: PacedClock
    ) -> None:
        self.axes = tuple(bus.axes)
        self._clock = clock
        self.health = BusHealth()
        self.alarms = 0
        self._layout = layout = GroupLayout(self.axes)
        arrays.begin(self.axes, period_s, lockstep=False)
        self.ints, self._floats = arrays.ints, arrays.floats
        self._words, self._flags = arrays.words, arrays.flags
        self.valid = arrays.feedback.valid
        self._seen = arrays.ints[codec.TPDOS_RECEIVED]
        self._rx = FrameBuffer(_FRAMES_PER_AXIS * len(self.axes) + _SPARE_FRAMES)
        self._others = np.zeros(len(self._rx.rows) + 1, np.int64)
        self._missing = 0
        self._sync_pending = False
        self._compile()
        filters = [(i, 0x7FF) for i in (_SYNC_ID, *layout.identifiers)]
        self._port = open_port(bus.url, filters, self.health)
        self.lockstep = bus.url.asks_for_lockstep or self._port.status.get("mode") == "lockstep"
        self.wait_s = _LOCKSTEP_ANSWER_S if self.lockstep else _ANSWER_SHARE * period_s
        self._port.settimeout(0.0)
        self._port.drain()

    def _compile(self) -> None:
        """Compile the kernels now, so that no cycle is late because of it."""
        self._decode(0)
        self.end_cycle()
        self.ints[codec.MISSED] = self.ints[codec.SILENT_CYCLES] = 0
        self.forget_alarms()

    def forget_alarms(self) -> None:
        """Forget latched alarms and recorded irregularities."""
        for row in (codec.ALARM, codec.FAULTED, codec.SILENT_CYCLES, codec.HEARTBEAT_AGE):
            self.ints[row] = 0
        for row in (codec.FRAMES, codec.FLOOD, codec.EXTRA, codec.EMERGENCY):
            self.ints[row] = 0
        self._floats[codec.IRREGULAR] = 0.0
        # the first index that the other master has latched is taken as the axis' index
        known = self._flags[codec.INDEX_KNOWN]
        self.ints[codec.PROBE_ARMED] = self._layout.probe_mapped & ~known
        self.alarms = 0

    def sync_waiting(self, deadline: float) -> bool:
        """Decode frames until `deadline`; return whether the next SYNC has arrived."""
        if not self._sync_pending:
            self._sync_pending = self._listen(deadline)
        return self._sync_pending

    def skip_cycle(self) -> None:
        """Skip the SYNC that has arrived; the answers to it then count as late."""
        self._sync_pending = False

    def await_sync(self, deadline: float) -> bool:
        """Wait for the next SYNC and begin its cycle; return whether it arrived in time."""
        self.valid.fill(False)
        if not self._sync_pending and not self._listen(deadline):
            return False
        self._sync_pending = False
        self._seen.fill(0)
        self._missing = len(self.axes)
        return True

    def collect_answers(self, deadline: float) -> int:
        """Receive answers until all or the next SYNC arrived, or time is up; return how many."""
        awaited_before = self._missing
        if awaited_before:
            self._sync_pending = self._listen(deadline)
        answered, self._missing = awaited_before - self._missing, 0
        return answered

    def _listen(self, deadline: float) -> bool:
        """Receive frames until SYNC or `deadline`; return whether SYNC arrived.

        If answers are expected, the last of them also ends the wait.
        """
        recv_into, rows = self._port.recv_into, self._rx.rows
        awaited = self._missing > 0
        while True:
            last, came = 0, False
            try:
                for row in rows:
                    if not recv_into(row):
                        raise self._port.lost()
                    if row[:4] == _SYNC_HEAD:
                        came = True
                        break
                    last += 1
            except BlockingIOError:
                pass
            except OSError as error:
                raise self._port.lost(error) from error
            if last:
                self._missing -= min(self._decode(last), self._missing)
            if came or (awaited and not self._missing):
                return came
            if self._clock.now_s >= deadline:
                return False
            if last < len(rows):
                self._clock.await_readable(self._port, deadline)

    def _decode(self, last: int) -> int:
        layout = self._layout
        return codec.decode(
            self._rx.bytes, layout.slots, layout.fields, STATE_TABLE, self.ints, self._floats,
            self._words, self._flags, self._others, last,
        )  # fmt: skip

    def end_cycle(self) -> None:
        """Count which axes were silent, irregular or without heartbeat."""
        codec.end_answers(self.ints, self._floats, self._flags)
        alarms = self.ints[codec.ALARM]
        alarms &= ~_OTHER_MASTERS_ALARMS
        self.alarms = int(np.bitwise_or.reduce(alarms))

    def close(self) -> None:
        """Leave the bus."""
        self._port.close()

"""CiA 402 axes on several buses, exchanged once per cycle as one device."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cdpr_drivers.axes.axis_group import AxisGroup, StateArrays
from cdpr_drivers.axes.axis_layout import AxisConfig
from cdpr_drivers.canopen.network import CanNetwork
from cdpr_drivers.cia402 import POWER_OFF, State
from cdpr_drivers.errors import BusError, DriverError, ModeRefusedError
from cdpr_rt.arrays import BoolArray
from cdpr_rt.core.clock import Clock
from cdpr_rt.core.exchange import AxisCommand, AxisFeedback
from cdpr_rt.core.fault import Fault

_STOP_TIMEOUT_S = 1.0
_SHORTEST_SLEEP_S = 5e-5
"""Shorter waits are left to the timeouts of the sockets."""
_RISE, _FALL = 0.1, 0.995


@dataclass(frozen=True)
class BusAxes:
    """The axes on one bus, and their numbers in the whole device, 0 to n - 1."""

    name: str
    network: CanNetwork
    axes: Sequence[AxisConfig]
    axis_numbers: Sequence[int]
    commands_s: float
    """Longest time that the commands of a cycle take on the wire."""


class AxisBuses:
    """n axes on several buses; implements `cdpr_rt.core.exchange.AxisDevice` as `AxisGroup` does.

    If the axes are numbered bus by bus, the arrays of each bus are slices of the whole, and nothing
    is copied. Otherwise their values are copied once a cycle. If one bus fails, the loop still
    exchanges the others, and switches them off at the end.

    Raises BusError if only some of the buses run in lockstep, and DriverError for a PDO map that
    does not support torque control.
    """

    def __init__(self, buses: Sequence[BusAxes], period_s: float) -> None:
        self.buses = tuple(buses)
        self.period_s = period_s
        self.clock = buses[0].network.clock
        order = [number for bus in buses for number in bus.axis_numbers]
        self.n = len(order)
        arrays = StateArrays(self.n)
        self.groups: list[AxisGroup] = []
        self._location: dict[int, tuple[AxisGroup, int]] = {}
        try:
            first = 0
            for bus in buses:
                view = arrays.view(first, first + len(bus.axes))
                group = AxisGroup(bus.network, bus.axes, period_s, view)
                self.groups.append(group)
                self._location |= {number: (group, i) for i, number in enumerate(bus.axis_numbers)}
                first += group.n
            self.lockstep = self._common_clock()
        except BaseException:
            for group in self.groups:
                group.close()
            raise
        self.commands_s = max(bus.commands_s for bus in buses)
        self.axes: tuple[AxisConfig, ...] = tuple(self._by_axis(lambda group: group.axes))
        self.feedback, self.command = arrays.feedback, arrays.command
        self._reordering = AxisReordering(order, self.feedback, self.command)
        if self._reordering.needed:
            self.feedback, self.command = self._reordering.feedback, self._reordering.command
        self._single_group = (
            self.groups[0] if len(self.groups) == 1 and not self._reordering.needed else None
        )
        if self._single_group is not None:  # the group counts the cycles
            self.feedback, self.command = self._single_group.feedback, self._single_group.command
        self.transmits = 0
        """Number of times that commands were sent on all buses."""
        self._answers = AnswerWait(self.clock, self.groups[0].paced_wait_s)
        self._sync_s = 0.0
        self._failed = [False] * len(self.groups)
        """Which buses have failed in this cycle."""
        self._failure: BusError | None = None
        self._found: list[tuple[Fault, ...]] = [()] * len(self.groups)
        self._placed: list[tuple[Fault, ...]] = [()] * len(self.groups)
        """The faults in `_found` as the groups last reported them, numbered in the whole device."""
        self._closed = False

    def _common_clock(self) -> bool:
        for group, bus in zip(self.groups, self.buses, strict=True):
            if group.lockstep != self.groups[0].lockstep:
                clocks = ("paced", "lockstep")
                raise BusError(
                    f"bus {bus.name} ({group.network.url}) is {clocks[group.lockstep]}, bus "
                    f"{self.buses[0].name} is {clocks[self.groups[0].lockstep]}: all buses of a "
                    "robot must be of the same kind"
                )
        return self.groups[0].lockstep

    # -- one cycle

    def sync(self) -> None:
        """Send the SYNC that opens the cycle, on one bus immediately after the other.

        If one of several buses fails, `receive` raises after the others have answered.
        """
        self._failure = None
        if not self.lockstep:
            self._sync_s = self.clock.now_s
        if self._single_group is not None:
            self._failed[0] = False
            try:
                self._single_group.sync()
            except BusError as error:
                self._mark_failed(0, error)
                raise
            return
        self.feedback.cycle += 1
        self.feedback.time_s = self.feedback.cycle * self.period_s
        for i, group in enumerate(self.groups):
            self._failed[i] = False
            try:
                group.sync()
            except BusError as error:
                self._mark_failed(i, error)

    def receive(self) -> int:
        """Wait for the answers on all buses and decode them; return how many axes answered."""
        if self._single_group is not None and self.lockstep:
            try:
                return self._single_group.receive()
            except BusError as error:
                self._mark_failed(0, error)
                raise
        if self.lockstep:
            return self._receive(0.0)
        self._answers.sleep(self._sync_s)
        waits = sum(group.waits for group in self.groups)
        answered = self._receive(self._sync_s + self.groups[0].paced_wait_s)
        too_early = sum(group.waits for group in self.groups) > waits
        self._answers.learn(self.clock.now_s - self._sync_s, too_early)
        return answered

    def _receive(self, deadline_s: float) -> int:
        answered = 0
        for i, group in enumerate(self.groups):
            if self._failed[i]:
                continue
            try:
                answered += group.receive(deadline_s)
            except BusError as error:
                self._mark_failed(i, error)
        if self._reordering.needed:
            self._reordering.gather()
        if self._failure is not None:
            raise self._failure
        return answered

    def _mark_failed(self, i: int, error: BusError) -> None:
        """Mark a bus as failed and the feedback of its axes as invalid."""
        self._failed[i] = True
        self._failure = self._failure or error
        feedback = self.groups[i].feedback
        for flags in (feedback.valid, feedback.alive, feedback.rate_ok):
            flags.fill(False)

    def transmit(self, and_sync: bool = False) -> None:
        """Send controlwords and torques on all buses, to act from the next SYNC on.

        With `and_sync` send the SYNC of the next cycle too, see `AxisGroup.transmit`.
        """
        if self._single_group is not None:
            self._single_group.transmit(and_sync)
            self.transmits += 1
            return
        if self._reordering.needed:
            self._reordering.scatter()
        failure: BusError | None = None
        for group in self.groups:
            try:
                group.transmit()
            except BusError as error:
                failure = failure or error
        if self._reordering.needed:
            self._reordering.gather_sent()
        if failure is not None:
            raise failure
        self.transmits += 1
        if and_sync:  # only now: drives of all buses share their physics
            for group in self.groups:
                group.sync_ahead()

    def faults(self) -> tuple[Fault, ...]:
        """Return why the drives of all buses must be stopped, in the order of the buses."""
        found: tuple[Fault, ...] = ()
        for i, group in enumerate(self.groups):
            faults = group.faults()
            if faults is not self._found[i]:
                bus = self.buses[i]
                self._found[i], self._placed[i] = faults, placed(faults, bus.name, bus.axis_numbers)
            found += self._placed[i]
        return found

    @property
    def missed(self) -> int:
        """Number of answers, over all axes, that have not arrived in time since the start."""
        return sum(group.missed for group in self.groups)

    # -- between cycles

    def stop_cycling(self) -> None:
        """Announce that no cycles run for a while; see `AxisGroup.stop_cycling`."""
        for group in self.groups:
            group.stop_cycling()

    def tolerate_silence(self, cycles: int) -> None:
        """Tolerate this many cycles without an answer; see `AxisGroup.tolerate_silence`."""
        for group in self.groups:
            group.tolerate_silence(cycles)

    def request(self, state: State) -> None:
        """Request a state of all axes; if one refuses, none is enabled. See `AxisGroup.request`."""
        try:
            for group in self.groups:
                group.request(state)
        except DriverError:
            for group in self.groups:
                group.request(State.SWITCH_ON_DISABLED)
            raise

    def reached(self, state: State) -> bool:
        """Return whether all axes report `state`."""
        return all(group.reached(state) for group in self.groups)

    def states(self) -> list[State]:
        """Return the state that each axis reported last."""
        return self._by_axis(AxisGroup.states)

    def faulted(self) -> BoolArray:
        """Return which axes have been in fault since the last acknowledgement, (n,)."""
        return np.array(self._by_axis(AxisGroup.faulted))

    def acknowledge_fault(self) -> None:
        """Forget latched alarms and reset drives in fault; see `AxisGroup.acknowledge_fault`."""
        for group in self.groups:
            group.acknowledge_fault()

    def switch_off_lost(self) -> None:
        """Start to cut the power of drives that do not follow; see `AxisGroup.switch_off_lost`."""
        for group in self.groups:
            group.switch_off_lost()

    @property
    def torque_modes(self) -> list[int]:
        """Return the mode in which each drive accepts torques, from its profile."""
        return self._by_axis(lambda group: group.torque_modes)

    def ask_mode(self, modes: int | Sequence[int]) -> None:
        """Request a mode of operation, one for all or one each; see `AxisGroup.ask_mode`."""
        each = [modes] * self.n if isinstance(modes, int) else list(modes)
        for group, bus in zip(self.groups, self.buses, strict=True):
            group.ask_mode([each[number] for number in bus.axis_numbers])

    def mode_confirmed(self) -> bool:
        """Return whether every axis reports its requested mode; raises SdoError."""
        return all(group.mode_confirmed() for group in self.groups)

    def unconfirmed_mode(self) -> ModeRefusedError:
        """Return the error that names the first axis that is not in its requested mode."""
        groups = (group for group in self.groups if not group.mode_confirmed())
        return next(groups, self.groups[0]).unconfirmed_mode()

    def group_of(self, axis: int) -> tuple[AxisGroup, int]:
        """Return the group of an axis, and its number in that group."""
        return self._location[axis]

    def _by_axis(self, ask: Callable[[AxisGroup], Any]) -> list[Any]:
        """Return the answers of all groups, in the order of the axes."""
        answers = {group: ask(group) for group in self.groups}
        return [answers[group][i] for group, i in map(self.group_of, range(self.n))]

    def heartbeat_age_s(self) -> list[float]:
        """Return the time since each drive's last heartbeat, counted in cycles."""
        return self._by_axis(AxisGroup.heartbeat_age_s)

    # -- the end

    def close(self) -> str:
        """Remove torque and power from the drives of all buses; a second call does nothing.

        Returns, as text, the drives that have not confirmed that their power stage is off, or "".
        """
        if self._closed:
            return ""
        self._closed = True
        try:
            self._stop_together()
        finally:
            # close powered groups last: that may take seconds, in which the others' heartbeats
            # continue
            unconfirmed = [group.close() for group in sorted(self.groups, key=_has_power)]
        return "; ".join(text for text in unconfirmed if text)

    def _stop_together(self) -> None:
        """Disable the drives of all buses in the same cycles, so that none waits for another."""
        live = list(self.groups)
        for group in live:
            group.request(State.SWITCH_ON_DISABLED)
        until_s = self.clock.now_s + _STOP_TIMEOUT_S
        while live and self.clock.now_s < until_s:
            self.command.torque_Nm[:] = 0.0
            for step in (AxisGroup.sync, AxisGroup.receive, _transmit_zero):
                live = [group for group in live if _succeeds(group, step)]
            if not any(_has_power(group) for group in live):
                return
            for group in live:
                group.switch_off_lost()
            self.clock.run_tasks()
            if not self.lockstep:
                self.clock.sleep(self.period_s)
            elif live:  # a bus whose group has dropped out still needs somebody to advance its time
                live[0].let_other_buses_follow()


def placed(faults: Sequence[Fault], bus: str, axis_numbers: Sequence[int]) -> tuple[Fault, ...]:
    """Return faults of the axes of one bus with their numbers in the whole device."""
    return tuple(
        fault._replace(
            axis=axis_numbers[fault.axis] if fault.axis >= 0 else -1,
            source=f"bus {bus} {fault.source}".strip(),
        )
        for fault in faults
    )


def _has_power(group: AxisGroup) -> bool:
    return not all(state in POWER_OFF for state in group.states())


def _transmit_zero(group: AxisGroup) -> None:
    group.command.torque_Nm[:] = 0.0
    group.transmit()


def _succeeds(group: AxisGroup, step: Any) -> bool:
    try:
        step(group)
    except BusError:
        return False
    return True


class AxisReordering:
    """Copies values between arrays in bus order and arrays in axis order."""

    def __init__(self, order: Sequence[int], feedback: AxisFeedback, command: AxisCommand) -> None:
        n = len(order)
        self.needed = list(order) != sorted(order)
        self.feedback, self.command = AxisFeedback(n), AxisCommand(n)
        self._numbers: NDArray[np.intp] = np.array(order, np.intp)
        self._columns: NDArray[np.intp] = np.argsort(self._numbers)
        self._pairs = [
            (value, getattr(self.feedback, name))
            for name, value in vars(feedback).items()
            if isinstance(value, np.ndarray)
        ]
        self._bus_command = command

    def gather(self) -> None:
        """Copy the feedback of the buses to the device."""
        for in_bus_order, in_axis_order in self._pairs:
            np.take(in_bus_order, self._columns, out=in_axis_order, mode="clip")

    def scatter(self) -> None:
        """Copy the commanded torques to the buses."""
        in_axis_order, in_bus_order = self.command.torque_Nm, self._bus_command.torque_Nm
        np.take(in_axis_order, self._numbers, out=in_bus_order, mode="clip")

    def gather_sent(self) -> None:
        """Copy the sent torques from the buses to the device."""
        sent, in_axis_order = self._bus_command.sent_torque_Nm, self.command.sent_torque_Nm
        np.take(sent, self._columns, out=in_axis_order, mode="clip")


class AnswerWait:
    """Sleeps until the answers have usually arrived, and adapts that time from cycle to cycle.

    A wake-up costs the host more than reading the frames of a whole cycle. `most_s` limits the
    sleep, counted from SYNC.
    """

    def __init__(self, clock: Clock, most_s: float) -> None:
        self._clock, self._most_s = clock, most_s
        self._expected_s = 0.0

    def sleep(self, since_s: float) -> None:
        """Sleep until the answers to the SYNC sent at `since_s` have usually arrived."""
        until_s = since_s + self._expected_s
        if until_s - self._clock.now_s > _SHORTEST_SLEEP_S:
            self._clock.sleep_until(until_s)

    def learn(self, took_s: float, too_early: bool) -> None:
        """Adapt the sleep to the time of the last answer, and to whether it ended too early."""
        if too_early:
            took_s = min(took_s, self._most_s)
            self._expected_s += _RISE * (took_s - self._expected_s)
        else:  # the answers may have come earlier; only an earlier wake-up can show that
            self._expected_s *= _FALL

"""A group of CiA 402 axes on one bus, exchanged once per cycle as arrays, and their faults."""

from __future__ import annotations

import math
import select
from collections.abc import Sequence
from functools import cached_property, partial
from typing import Self

import numpy as np

from cdpr_drivers.axes import axis_codec as codec
from cdpr_drivers.axes.axis_codec import Ints
from cdpr_drivers.axes.axis_layout import AxisConfig, GroupLayout
from cdpr_drivers.bus.frames import FRAME
from cdpr_drivers.bus.simbus import SimulatedBus
from cdpr_drivers.canopen.error_control import OPERATIONAL, nmt_name
from cdpr_drivers.canopen.network import CanNetwork
from cdpr_drivers.cia402 import (
    CONTROLWORD_TABLE,
    HALT,
    POWER_OFF,
    STATE_TABLE,
    TARGETS,
    State,
    fault_text,
    mode_name,
    supports,
)
from cdpr_drivers.drive_units import whole_units
from cdpr_drivers.errors import (
    BusError,
    DriveFaultError,
    DriverError,
    ModeRefusedError,
    SdoError,
)
from cdpr_profiles.robot_limits import Limit
from cdpr_rt.arrays import BoolArray, FloatArray, WordArray
from cdpr_rt.core.exchange import AxisCommand, AxisFeedback
from cdpr_rt.core.fault import IN_FAULT, Fault
from cdpr_rt.jit import bound

# The arrays in which a group of axes keeps its state from cycle to cycle.

NO_MODE = -1000
"""Requested mode of an axis for which no mode was requested."""

_PACED_SILENT_CYCLES = 3
# a heartbeat that is late by most of a period was not sent: CAN repeats disturbed frames itself
_HEARTBEAT_TIMEOUT_PERIODS = 1.75

# maximum for one drive; a bus of 1 Mbit/s carries about 9000 frames a second in total
_FRAMES_A_CYCLE, _FRAMES_A_SECOND = 8, 4000


class StateArrays:
    """State of n axes as arrays: the rows named in `axis_codec`, one column per axis."""

    def __init__(self, n: int) -> None:
        # the extra column gives these arrays the strides of a view of some axes, so that kernels
        # are compiled for one memory layout only
        self.ints: Ints = np.zeros((codec.INT_ROWS, n + 1), np.int64)[:, :n]
        self.floats: FloatArray = np.zeros((codec.FLOAT_ROWS, n + 1))[:, :n]
        self.flags: BoolArray = np.zeros((codec.FLAG_ROWS, n + 1), np.bool_)[:, :n]
        self.words: WordArray = np.zeros((1, n), np.uint16)

    def view(self, first: int, last: int) -> StateArrays:
        """Return the axes `first` up to `last` as views into the same arrays."""
        view = StateArrays(0)
        view.ints, view.floats = self.ints[:, first:last], self.floats[:, first:last]
        view.flags, view.words = self.flags[:, first:last], self.words[:, first:last]
        return view

    @cached_property
    def feedback(self) -> AxisFeedback:
        """The feedback, whose arrays are rows of the state arrays."""
        feedback = AxisFeedback(self.ints.shape[1])
        feedback.position_rad = self.floats[codec.POSITION_RAD]
        feedback.torque_Nm = self.floats[codec.TORQUE_NM]
        feedback.index_rad = self.floats[codec.INDEX_RAD]
        feedback.valid = self.flags[codec.VALID]
        feedback.index_known = self.flags[codec.INDEX_KNOWN]
        feedback.alive = self.flags[codec.ALIVE]
        feedback.rate_ok = self.flags[codec.RATE_OK]
        feedback.statusword = self.words[0]
        return feedback

    @cached_property
    def command(self) -> AxisCommand:
        """The command, whose arrays are rows of the state arrays."""
        command = AxisCommand(self.ints.shape[1])
        command.torque_Nm = self.floats[codec.COMMAND_NM]
        command.sent_torque_Nm = self.floats[codec.SENT_NM]
        return command

    def begin(self, axes: Sequence[AxisConfig], period_s: float, lockstep: bool) -> None:
        """Write the initial state of the axes and the properties of their drives."""
        ints, floats = self.ints, self.floats
        ints[codec.TARGET] = State.SWITCH_ON_DISABLED
        ints[codec.STATE] = State.UNKNOWN
        ints[codec.MODE_REQUESTED] = NO_MODE
        # in lockstep, bus time stands still until the wait for the answer ends
        ints[codec.SILENCE_LIMIT] = 1 if lockstep else _PACED_SILENT_CYCLES
        for i, axis in enumerate(axes):
            floats[codec.RAD_PER_COUNT, i] = axis.rad_per_count
            floats[codec.NM_PER_UNIT, i] = axis.Nm_per_unit
            ints[codec.TPDOS_EXPECTED, i] = axis.expected_tpdos
            most = whole_units(axis.torque_limit_Nm, abs(axis.Nm_per_unit))
            floats[codec.LIMIT_UNITS, i] = min(most, axis.most_torque_units)
            ints[codec.FRAMES_ALLOWED, i] = max(_FRAMES_A_CYCLE, round(_FRAMES_A_SECOND * period_s))
            timeout_s = _HEARTBEAT_TIMEOUT_PERIODS * axis.drive.heartbeat_producer_s
            ints[codec.HEARTBEAT_LIMIT, i] = max(2, round(timeout_s / period_s))


# Faults of a group of axes, derived from their alarm bits.

_MASTER_LOST_CODES = (0x8130, 0x8250)
"""EMCY codes of a drive that misses the master's heartbeat or its commands."""


def axis_faults(axes: Sequence[AxisConfig], ints: Ints) -> tuple[Fault, ...]:
    """Return the fault of each axis with a raised alarm: its most likely cause."""
    raised = np.flatnonzero(ints[codec.ALARM]).tolist()
    return tuple(_axis_fault(axes[i], i, ints[:, i]) for i in raised)


def _axis_fault(axis: AxisConfig, i: int, column: Ints) -> Fault:
    bits, error = int(column[codec.ALARM]), fault_text(int(column[codec.EMERGENCY]))
    displayed, requested = int(column[codec.MODE_DISPLAYED]), int(column[codec.MODE_REQUESTED])
    missed, repeated = int(column[codec.MISSED]), int(column[codec.REPEATED])
    nmt = int(column[codec.NMT_STATE])
    code, _, meaning = error.partition(" ")
    if bits & codec.SILENT and int(column[codec.EMERGENCY]) in _MASTER_LOST_CODES:
        # the cycle sends nothing while it waits for an answer, so the drive reports a missing
        # master: a consequence of the silence, not its cause
        bits &= ~codec.EMERGENCY_MESSAGE
    state, none = int(column[codec.STATE]), math.nan
    modes = f"{mode_name(displayed)}, not {mode_name(requested)}"
    last = f"last error {error}" if bits & codec.EMERGENCY_MESSAGE else ""
    silent, bridged = int(column[codec.SILENT_CYCLES]), int(column[codec.SILENCE_LIMIT]) - 1
    unsteady = "doubled" if repeated > missed else "unsteady"
    # most likely cause first
    kinds: tuple[tuple[int, str, float, float, str], ...] = (
        (codec.RESTARTED, "restarted", none, none, ""),
        (codec.FLOODING, "flooding", none, none, last),
        (codec.EMERGENCY_MESSAGE, code, none, none, meaning),
        (codec.FAULT, IN_FAULT, none, none, ""),
        (codec.WRONG_MODE, "wrong_mode", displayed, requested, modes),
        (codec.LEFT_ENABLED, "left_enabled", state, State.OPERATION_ENABLED, State(state).label),
        (codec.SILENT, "silent", silent, bridged, ""),
        (codec.UNSTEADY, unsteady, max(missed, repeated), none, ""),
        (codec.NO_HEARTBEAT, "no_heartbeat", none, axis.drive.heartbeat_producer_s, ""),
        (codec.NOT_OPERATIONAL, "not_operational", nmt, OPERATIONAL, nmt_name(nmt)),
        (codec.NOT_FINITE, "not_finite", none, none, ""),
    )
    _, code, value, allowed, detail = next(kind for kind in kinds if bits & kind[0])
    return Fault(Limit.DRIVE, i, code, f"node {axis.node_id}", value, allowed, detail)


# The cyclic exchange of n axes on one bus: SYNC out, feedback in, commands out.

_SYNC_ID = 0x080
# Timeouts in wall time, used if another process leads the lockstep. The first is for the first
# answer, because the simulator may be delayed. The second is for the last answer, and shorter than
# the time for which bus time stands still. The third applies after a cycle that missed an answer.
_ANSWER_TIMEOUT_S, _PARTIAL_ANSWER_TIMEOUT_S, _REPEATED_TIMEOUT_S = 2.0, 0.4, 0.02
_PACED_SHARE = 0.75
_POWER_OFF_TIMEOUT_S = 1.0
_LOST_TIMEOUT_S = 0.1
"""Timeout for the answer of a lost drive to an SDO; short, because the drive may be pulling."""


def has_deadline(axis: AxisConfig) -> bool:
    """Return whether the drive checks for late RPDOs (1400h:05)."""
    return any(pdo.event_timer_s > 0.0 for pdo in axis.drive.rpdos)


class AxisGroup:
    """n axes on one bus; implements `cdpr_rt.core.exchange.AxisDevice`.

    When used as a context manager, it leaves the drives without power, however the block ends. An
    axis is enabled only after a `request`, in a mode that the drive has confirmed; a fault cancels
    the request and stays until `acknowledge_fault`. The arrays of `feedback` and `command` are
    overwritten in place and must not be replaced. `arrays` holds the state if these axes are part
    of a larger device. A cycle allocates nothing, takes no lock and does not log.

    Raises BusError if the bus is gone, and DriverError for a PDO map that does not support torque
    control.
    """

    def __init__(
        self,
        network: CanNetwork,
        axes: Sequence[AxisConfig],
        period_s: float,
        arrays: StateArrays | None = None,
    ) -> None:
        self.axes = tuple(axes)
        self.n = len(self.axes)
        self.period_s = period_s
        self.paced_wait_s = _PACED_SHARE * period_s
        self.network = network
        self.clock = network.clock
        self.lockstep = network.lockstep
        self._layout = GroupLayout(self.axes)
        self._reader = network.reader
        self._port = self._reader.port
        self._commands = self._port.batch(self._layout.rpdos)
        self._others = np.zeros(len(self._reader.frames.rows) + 1, np.int64)
        self._sync_frame = FRAME.pack(_SYNC_ID, 0, bytes(8))
        # bus time, not a number of cycles: delayed cycles must not delay the heartbeat
        self._heartbeat_every_s = network.heartbeat_s - 0.5 * period_s
        self._heartbeat_at_s = 0.0
        self._cycling = self._closed = False
        self._missing = 0
        """Axes that have not yet answered the last SYNC."""
        self._late = False
        self.waits = 0
        """Number of waits for a frame, in paced cycles."""
        self._alarms = 0
        self._switching_off = set[int]()
        """Nodes of lost drives whose power is being cut."""
        self._faults: tuple[Fault, ...] = ()
        self._faults_bits: Ints = np.zeros(self.n, np.int64)
        """Alarm bits from which `_faults` was made."""
        self._synced_ahead = False
        """Whether the SYNC of the next cycle has been sent."""
        self._alarm: Fault | None = None
        self._alarm_faults: tuple[Fault, ...] = ()
        """Faults made from `_alarm`, an alarm of the network."""
        state = arrays or StateArrays(self.n)
        state.begin(self.axes, period_s, self.lockstep)
        self._ints, self._floats = state.ints, state.floats
        self._words, self._flags = state.words, state.flags
        self.feedback, self.command = state.feedback, state.command
        self._valid = state.feedback.valid
        self._seen = state.ints[codec.TPDOS_RECEIVED]
        network.set_extra_filters(self._layout.identifiers)
        layout, rows = self._layout, (state.ints, state.floats)
        # bind, and thereby compile, here: a first cycle that takes seconds would look like a lost
        # master
        self._decode = bound(
            codec.decode, self._reader.frames.bytes, layout.slots, layout.fields, STATE_TABLE,
            *rows, state.words, state.flags, self._others, then=(0,),
        )  # fmt: skip
        self._end_answers = bound(codec.end_answers, *rows, state.flags)
        self._encode = bound(
            codec.encode, layout.rpdos.bytes, layout.command_offsets, CONTROLWORD_TABLE, *rows
        )

    def sync(self) -> None:
        """Send the SYNC that opens the cycle."""
        if not self._cycling:
            self._begin_cycling()
        if not self._reader.leads_time:
            # a late frame must not count as an answer to the next SYNC
            self._reader.settle()
        feedback = self.feedback
        feedback.cycle += 1
        feedback.time_s = feedback.cycle * self.period_s
        self._valid.fill(False)
        self._seen.fill(0)
        self._missing = self.n
        if self._synced_ahead:
            self._synced_ahead = False
        else:
            self._send_sync()

    def sync_ahead(self) -> None:
        """Send the SYNC of the next cycle now, for a caller that sends nothing else before it.

        Call it only within a cycle, on a bus whose time this process leads: there the answers wait.
        """
        self._send_sync()
        self._synced_ahead = True

    def _send_sync(self) -> None:
        try:
            self._port.send(self._sync_frame)
        except OSError as error:
            raise self._reader.lost(error) from error

    def receive(self, deadline_s: float = 0.0) -> int:
        """Wait for the answers to this SYNC and decode them; return how many axes answered.

        On a bus that this process leads, the bus reports when all have answered. Otherwise the wait
        ends at `deadline_s` (CLOCK_MONOTONIC), by default so that a share of the period remains
        for computing and sending. If another process leads the lockstep, the wait ends later.
        """
        reader = self._reader
        if isinstance(reader, SimulatedBus):
            before_s = reader.now_s
            reader.receive_until_time()
            if reader.now_s == before_s:  # no drive knows the period (1006h), as after a restart
                reader.go(before_s + self.period_s)
        elif self.lockstep:
            now_s = self.clock.now_s
            some_s = now_s + (_REPEATED_TIMEOUT_S if self._late else _PARTIAL_ANSWER_TIMEOUT_S)
            self._receive_until(some_s, some_s if self._late else now_s + _ANSWER_TIMEOUT_S)
        else:
            deadline_s = deadline_s or self.clock.now_s + self.paced_wait_s
            self._receive_until(deadline_s, deadline_s)
        self._alarms = self._end_answers()
        return self.n - self._missing

    def let_other_buses_follow(self) -> None:
        """Bring the time of all other buses that this process leads up to the time of this bus.

        A cycle advances only the time of its bus, and the clock shows the earliest time of all.
        """
        if isinstance(self._reader, SimulatedBus):
            self.clock.sleep_until(self._reader.now_s)

    def _receive_until(self, until_s: float, silent_until_s: float) -> None:
        """Process received frames; wait for more only while an axis has not answered.

        The wait ends at `until_s`, or at `silent_until_s` if no axis has answered.
        """
        while True:
            self._reader.poll()
            end_s = until_s if self._missing < self.n else silent_until_s
            left_s = end_s - self.clock.now_s
            if not self._missing or left_s <= 0.0:
                self._late = self._missing > 0
                return
            self.waits += 1
            # the kernel's own receive timeout is too coarse for a cycle
            select.select([self._port], [], [], left_s)

    def _take(self, last: int) -> None:
        """Decode the first `last` frames of the reader; pass the others to the network."""
        others = self._others
        self._missing -= self._decode(last)
        if others[0]:
            rows = self._reader.frames.rows
            for k in others[1 : others[0] + 1]:
                self.network.take_frame(rows[k])

    def transmit(self, and_sync: bool = False) -> None:
        """Send controlwords and torques, to act from the next SYNC on.

        With `and_sync` send that SYNC too, see `sync_ahead`. A torque that is not a finite number
        is sent as zero and raises the alarm.
        """
        self._alarms = self._encode()
        now_s = self.feedback.time_s if self.lockstep else self.clock.now_s
        heartbeat = now_s >= self._heartbeat_at_s
        try:
            if and_sync and not heartbeat:
                self._commands.send(self._sync_frame)
                self._synced_ahead = True
                return
            self._commands.send()
            if heartbeat:
                self._heartbeat_at_s = now_s + self._heartbeat_every_s
                self._port.send(self.network.heartbeat_frame)
        except OSError as error:
            raise self._reader.lost(error) from error
        if and_sync:
            self.sync_ahead()

    def faults(self) -> tuple[Fault, ...]:
        """Return why the drives must be stopped; axes are numbered within this group."""
        if not self._alarms:
            alarm = self.network.alarm
            if alarm is None:
                return ()
            if alarm is not self._alarm:
                sources = [f"node {axis.node_id}" for axis in self.axes]
                axis = sources.index(alarm.source) if alarm.source in sources else -1
                self._alarm, self._alarm_faults = alarm, (alarm._replace(axis=axis),)
            return self._alarm_faults
        bits = self._ints[codec.ALARM]
        if not np.array_equal(bits, self._faults_bits):
            self._faults_bits[:] = bits
            self._faults = axis_faults(self.axes, self._ints)
        return self._faults

    @property
    def missed(self) -> int:
        """Number of answers, over all axes, that have not arrived in time since the start."""
        return int(self._ints[codec.MISSED].sum())

    @property
    def late(self) -> int:
        """Number of answers, over all axes, that have arrived after their cycle since the start."""
        return int(self._ints[codec.LATE].sum())

    @property
    def repeated(self) -> int:
        """Number of answers, over all axes, that were repeated within a cycle since the start."""
        return int(self._ints[codec.REPEATED].sum())

    def _begin_cycling(self) -> None:
        """Take over the master's heartbeat; forget frames that arrived while no cycles ran."""
        self.network.hand_heartbeat_to_cycle()
        self._heartbeat_at_s = 0.0  # the last one between cycles may be a whole period old
        for axis in self.axes:
            if has_deadline(axis):
                self.network.start(axis.node_id, axis.drive.heartbeat_producer_s)
        self._reader.settle()
        for i, axis in enumerate(self.axes):
            if axis.node_id in self.network.restarted:
                # the drive has restarted while no cycles ran: only a new boot makes its index
                # usable again
                self._flags[codec.INDEX_KNOWN, i] = False
                self._ints[codec.ALARM, i] |= codec.RESTARTED
        self._ints[codec.HEARTBEAT_AGE] = 0
        self._forget_irregularities()
        self._reader.take = self._take
        self._cycling = True

    def _end_cycling(self) -> None:
        """Return received frames and the master's heartbeat to the network."""
        self._reader.take = self.network.take
        self._cycling = False
        self.network.release_cycle()

    def _forget_irregularities(self) -> None:
        self._floats[codec.IRREGULAR] = 0.0
        self._ints[codec.FRAMES] = self._ints[codec.FLOOD] = self._ints[codec.EXTRA] = 0

    # -- between cycles

    def stop_cycling(self) -> None:
        """Suspend the cycles; the network continues the master's heartbeat.

        Drives that check for late RPDOs wait in pre-operational. Raises DriveFaultError if an
        enabled state is still requested of an axis.
        """
        if np.any(self._ints[codec.TARGET] == State.OPERATION_ENABLED):
            raise DriveFaultError("cycles may only stop once the drives have been disabled")
        for axis in self.axes:
            if self._cycling and has_deadline(axis):
                self.network.stop_process_data(axis.node_id)
        self._end_cycling()

    def tolerate_silence(self, cycles: int) -> None:
        """Tolerate this many consecutive cycles without an answer."""
        self._ints[codec.SILENCE_LIMIT] = cycles + 1

    def request(self, state: State) -> None:
        """Request a state of all axes; the cycles lead them there step by step.

        Raises ValueError for a state that cannot be requested, DriveFaultError if a drive to be
        enabled has an unacknowledged fault, ModeRefusedError if its mode is not confirmed.
        """
        if state not in TARGETS:
            raise ValueError(f"{state.label} cannot be requested")
        if state == State.OPERATION_ENABLED:
            for axis, faulted in zip(self.axes, self.faulted(), strict=True):
                if faulted:
                    raise DriveFaultError(f"{axis.label}: acknowledge its fault before enabling it")
            if not self.mode_confirmed():
                raise self.unconfirmed_mode()
        self._ints[codec.TARGET] = state

    def reached(self, state: State) -> bool:
        """Return whether all axes report `state`."""
        return bool(np.all(self._ints[codec.STATE] == state))

    def states(self) -> list[State]:
        """Return the last state that each axis reported."""
        return [State(int(s)) for s in self._ints[codec.STATE]]

    def faulted(self) -> BoolArray:
        """Return which axes have been in fault since the last acknowledgement, (n,)."""
        return np.asarray(self._ints[codec.FAULTED] != 0)

    def acknowledge_fault(self) -> None:
        """Clear latched alarms; drives in fault get a fault reset with the next cycles.

        This enables no drive. A drive that stays in fault raises the alarm again after its
        `state_timeout_s`.
        """
        ints = self._ints
        for i, axis in enumerate(self.axes):
            if ints[codec.STATE, i] in (State.FAULT, State.FAULT_REACTION):
                cycles = round(axis.drive.state_timeout_s / self.period_s)
                ints[codec.ACKNOWLEDGE, i] = max(3, cycles)
        ints[codec.TARGET] = State.SWITCH_ON_DISABLED
        ints[codec.FAULTED] = 0
        ints[codec.ALARM] = 0
        ints[codec.SILENT_CYCLES] = 0
        ints[codec.HEARTBEAT_AGE] = 0
        self._forget_irregularities()
        self._alarms = 0
        self._switching_off.clear()
        self._faults_bits[:] = 0
        self.network.clear_alarm()

    def heartbeat_age_s(self) -> list[float]:
        """Return the time since each drive's last heartbeat, counted in cycles."""
        return [int(age) * self.period_s for age in self._ints[codec.HEARTBEAT_AGE]]

    def set_extra_bits(self, axis: int, bits: int) -> None:
        """Add mode-specific bits to an enabled axis' controlword (start of homing, halt)."""
        self._ints[codec.EXTRA_BITS, axis] = bits

    def switch_off_lost(self) -> None:
        """Start tasks that cut the power of drives that do not follow the cycle; do not wait.

        Use SDO, then an NMT reset if the drive does not answer; repeat only if sending failed.
        """
        if not self._alarms & codec.LOST:
            return
        for i, axis in enumerate(self.axes):
            node, lost = axis.node_id, self._ints[codec.ALARM, i] & codec.LOST
            if not lost or node in self._switching_off:
                continue
            if self._ints[codec.STATE, i] in POWER_OFF:
                continue
            self._switching_off.add(node)
            self.network.cancel(node)  # otherwise the next transfer waits for an unanswered one
            self.clock.start(partial(self._take_power, node))

    def _take_power(self, node: int) -> None:
        try:
            self.network.switch_off(node, _LOST_TIMEOUT_S, 1)
        except DriverError:
            self._switching_off.discard(node)  # retried in the next cycle

    # -- modes of operation

    @property
    def torque_modes(self) -> list[int]:
        """The mode in which each axis' drive accepts torques, for `ask_mode`."""
        return [axis.drive.mode_torque for axis in self.axes]

    def ask_mode(self, modes: int | Sequence[int]) -> None:
        """Request a mode of operation, one for all axes or one each.

        `mode_confirmed` reports when they have it. If an axis is enabled or lacks its mode, raises
        ModeRefusedError and changes nothing. If a drive refuses, raises it with the drive's reason;
        no axis can then be enabled until a mode is requested again.
        """
        requested = [modes] * self.n if isinstance(modes, int) else list(modes)
        for i, (axis, mode) in enumerate(zip(self.axes, requested, strict=True)):
            if self._ints[codec.STATE, i] == State.OPERATION_ENABLED:
                raise ModeRefusedError(
                    f"{axis.label}: the mode cannot change while the drive is enabled"
                )
            if not supports(axis.supported_modes, mode):
                raise ModeRefusedError(
                    f"{axis.label}: mode {mode_name(mode)} is not among the modes "
                    f"the drive supports (6502h = {axis.supported_modes:08X}h)"
                )
        self._ints[codec.MODE_REQUESTED] = NO_MODE
        for i, mode in enumerate(requested):
            self._write_mode(i, mode)
        self._ints[codec.MODE_REQUESTED] = requested

    def _write_mode(self, i: int, mode: int) -> None:
        node = self.axes[i].node_id
        try:
            if self.axes[i].drive.quirks.halt_before_mode_change:
                # until the next cycle's controlword clears the halt
                self.network.write(node, 0x6040, 0, HALT)
            self.network.write(node, 0x6060, 0, mode)
            self._ints[codec.MODE_DISPLAYED, i] = self.network.read_int(node, 0x6061)
        except SdoError as error:
            raise ModeRefusedError(
                f"{self.axes[i].label}: the drive rejected mode {mode_name(mode)}: {error}"
            ) from error

    def mode_confirmed(self) -> bool:
        """Return whether every axis reports its requested mode (6061h).

        Raises SdoError if a drive whose PDOs do not contain the mode cannot be read.
        """
        for i in np.flatnonzero(~self._layout.mode_mapped):
            displayed = self.network.read_int(self.axes[i].node_id, 0x6061)
            self._ints[codec.MODE_DISPLAYED, i] = displayed
        return bool(np.all(self._ints[codec.MODE_DISPLAYED] == self._ints[codec.MODE_REQUESTED]))

    def unconfirmed_mode(self) -> ModeRefusedError:
        """Return the error that names the first axis that is not in its requested mode."""
        displayed, requested = self._ints[codec.MODE_DISPLAYED], self._ints[codec.MODE_REQUESTED]
        i = int(np.flatnonzero(displayed != requested)[0])
        label = self.axes[i].label
        if requested[i] == NO_MODE:
            return ModeRefusedError(
                f"{label}: no mode of operation was requested yet, or the drive rejected the "
                "last one"
            )
        return ModeRefusedError(
            f"{label}: mode {mode_name(int(requested[i]))} was requested, but the drive "
            f"reports {mode_name(int(displayed[i]))} (6061h); it was not enabled"
        )

    # -- the encoder index

    def set_index(self, axis: int, position_rad: float) -> None:
        """Store the position of an axis' encoder index, after its drive has set a new origin."""
        ints = self._ints
        ints[codec.POSITION, axis] = ints[codec.LAST_RAW_POSITION, axis]
        self.feedback.index_rad[axis] = position_rad
        self.feedback.index_known[axis] = True

    def reports_probe(self, axis: int) -> bool:
        """Whether the drive's PDOs carry touch probe status and position."""
        return bool(self._layout.probe_mapped[axis])

    def expect_index(self, axis: int, armed: bool) -> None:
        """Use the next touch probe position of an axis as its index; stop this if not `armed`.

        Raises DriverError when the drive's PDOs do not carry touch probe status and position.
        """
        if armed and not self.reports_probe(axis):
            raise DriveFaultError(
                f"drive profile {self.axes[axis].drive.name!r}: tpdos: no TPDO holds both 60B9h "
                "and 60BAh, which the touch probe needs to find the index"
            )
        if armed:
            self._ints[codec.PROBE_STATUS, axis] = 0
            self.feedback.index_known[axis] = False
        self._ints[codec.PROBE_ARMED, axis] = armed

    # -- the end

    def close(self) -> str:
        """Remove torque and power from the drives and end the cycles; a second call does nothing.

        The cycles switch the drives off first. A drive that does not follow gets the commands by
        SDO, and a reset as the last resort. Returns the drives that have not confirmed that their
        power stage is off, as text; "" if all have. Raises nothing for a lost bus: its drives miss
        the master's heartbeat and stop.
        """
        if self._closed:
            return ""
        self._closed = True
        try:
            return self._switch_off()
        finally:
            self._end_cycling()

    def _switch_off(self) -> str:
        self._ints[codec.EXTRA_BITS] = 0
        try:
            if self._switch_off_by_cycles():
                return ""
            left = [a.label for a in self.axes if not self.network.switch_off(a.node_id)]
        except BusError as error:
            nodes = ", ".join(axis.label for axis in self.axes)
            return f"{nodes}: may still have power: {error}"
        if not left:
            return ""
        return (
            f"{', '.join(left)}: does not confirm that its power stage is off; it was reset "
            "(NMT); check that it has no power"
        )

    def _switch_off_by_cycles(self) -> bool:
        """Run cycles with zero torque; return whether every drive reports its power stage off."""
        clock = self.clock
        until_s = clock.now_s + _POWER_OFF_TIMEOUT_S
        self.request(State.SWITCH_ON_DISABLED)
        while clock.now_s < until_s:
            self.command.torque_Nm[:] = 0.0
            self.sync()
            answered = self.receive()
            self.transmit()
            if answered == self.n and all(state in POWER_OFF for state in self.states()):
                return True
            self.switch_off_lost()
            clock.run_tasks()
            if self.lockstep:
                self.let_other_buses_follow()
            else:
                clock.sleep(self.period_s)
        return False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, _kind: object, error: BaseException | None, _trace: object) -> None:
        unconfirmed = self.close()
        if not unconfirmed:
            return
        if error is None:
            raise DriveFaultError(unconfirmed)
        error.add_note(unconfirmed)

"""The cyclic exchange of n axes on one bus: SYNC out, feedback in, commands out."""

from __future__ import annotations

import select
from collections.abc import Sequence

import numpy as np

from cdpr_drivers.axes import axis_codec as codec
from cdpr_drivers.axes.axis_alarms import alarm_text
from cdpr_drivers.axes.axis_layout import AxisConfig, GroupLayout
from cdpr_drivers.axes.axis_state import StateArrays
from cdpr_drivers.bus.frames import FRAME
from cdpr_drivers.bus.simulated_bus import SimulatedBus
from cdpr_drivers.canopen.network import CanNetwork
from cdpr_drivers.cia402 import CONTROLWORD_TABLE, STATE_TABLE
from cdpr_rt.jit import bound

_SYNC_ID = 0x080
# in a lockstep that another process leads: wall time for the first answer, as the simulator may be
# held up; for the last one, less than bus time stands still; where one was missing last time
_ANSWER_TIMEOUT_S, _PARTIAL_ANSWER_TIMEOUT_S, _REPEATED_TIMEOUT_S = 2.0, 0.4, 0.02
_PACED_SHARE = 0.75


class AxisExchange:
    """The part of an axis group that runs in every cycle: no allocation, no lock, no logging.

    `arrays` hold the state where these axes are part of a larger device.
    Raises BusError when the bus goes away.
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
        # by the clock of the bus: cycles that are held up are fewer, not slower heartbeats
        self._heartbeat_every_s = network.heartbeat_s - 0.5 * period_s
        self._heartbeat_at_s = 0.0
        self._cycling = self._closed = False
        self._missing = 0
        """Axes that have not answered the last SYNC yet."""
        self._late = False
        self.waits = 0
        """How often a frame was waited for, in paced cycles."""
        self._alarms = 0
        state = arrays or StateArrays(self.n)
        state.begin(self.axes, period_s, self.lockstep)
        self._ints, self._floats = state.ints, state.floats
        self._words, self._flags = state.words, state.flags
        self.feedback, self.command = state.feedback, state.command
        self._valid = state.feedback.valid
        self._seen = state.ints[codec.TPDOS_RECEIVED]
        network.set_extra_filters(self._layout.identifiers)
        layout, rows = self._layout, (state.ints, state.floats)
        # bound, and so compiled, here: a first cycle of seconds would be a silent master
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
            # what came after its cycle is not to be taken for the next one's answer
            self._reader.settle()
        feedback = self.feedback
        feedback.cycle += 1
        feedback.time_s = feedback.cycle * self.period_s
        self._valid.fill(False)
        self._seen.fill(0)
        self._missing = self.n
        try:
            self._port.send(self._sync_frame)
        except OSError as error:
            raise self._reader.lost(error) from error

    def receive(self, deadline_s: float = 0.0) -> int:
        """Wait for the answers to this SYNC and decode them; return how many axes answered.

        On a bus that this process leads, the bus tells when all have answered. Otherwise the wait
        ends at `deadline_s` (CLOCK_MONOTONIC), by default so that a share of the period is left
        for computing and sending; in lockstep by another leader's time it ends later.
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
        """Have time on all buses that this process leads come as far as on this one.

        A cycle moves the time of its own bus alone, and the clock's is the earliest of all.
        """
        if isinstance(self._reader, SimulatedBus):
            self.clock.sleep_until(self._reader.now_s)

    def _receive_until(self, until_s: float, silent_until_s: float) -> None:
        """Process what has come; wait for more only while an axis has not answered.

        Up to `silent_until_s` while none has.
        """
        while True:
            self._reader.poll()
            end_s = until_s if self._missing < self.n else silent_until_s
            left_s = end_s - self.clock.now_s
            if not self._missing or left_s <= 0.0:
                self._late = self._missing > 0
                return
            self.waits += 1
            # the kernel's own receive time-out is too coarse for a cycle
            select.select([self._port], [], [], left_s)

    def _take(self, last: int) -> None:
        """Decode the first `last` frames of the reader; others go to the network."""
        others = self._others
        self._missing -= self._decode(last)
        if others[0]:
            rows = self._reader.frames.rows
            for k in others[1 : others[0] + 1]:
                self.network.take_frame(rows[k])

    def transmit(self) -> None:
        """Send controlwords and torques, to act from the next SYNC on.

        A torque that is not a finite number goes out as zero and raises the alarm.
        """
        self._alarms = self._encode()
        try:
            self._commands.send()
            now_s = self.feedback.time_s if self.lockstep else self.clock.now_s
            if now_s >= self._heartbeat_at_s:
                self._heartbeat_at_s = now_s + self._heartbeat_every_s
                self._port.send(self.network.heartbeat_frame)
        except OSError as error:
            raise self._reader.lost(error) from error

    def alarm(self) -> str:
        """Return why the drives must not go on being driven, or an empty text."""
        if self._alarms:
            return alarm_text(self.axes, self._ints)
        return self.network.alarm_text

    @property
    def missed(self) -> int:
        """Answers that did not come in time since the beginning, over all axes."""
        return int(self._ints[codec.MISSED].sum())

    @property
    def late(self) -> int:
        """Answers that came after their cycle since the beginning, over all axes."""
        return int(self._ints[codec.LATE].sum())

    @property
    def repeated(self) -> int:
        """Answers that came more than once in a cycle since the beginning, over all axes."""
        return int(self._ints[codec.REPEATED].sum())

    def _begin_cycling(self) -> None:
        """Take over the master's heartbeat and forget what came while no cycles ran."""
        self.network.hand_heartbeat_to_cycle()
        self._heartbeat_at_s = 0.0  # the last one between cycles may be a whole period ago
        for axis in self.axes:
            if has_deadline(axis):
                self.network.start(axis.node_id, axis.drive.heartbeat_producer_s)
        self._reader.settle()
        for i, axis in enumerate(self.axes):
            if axis.node_id in self.network.restarted:
                # while no cycles ran, and for good: only a new boot makes it usable again
                self._flags[codec.INDEX_KNOWN, i] = False
                self._ints[codec.ALARM, i] |= codec.RESTARTED
        self._ints[codec.HEARTBEAT_AGE] = 0
        self._forget_irregularities()
        self._reader.take = self._take
        self._cycling = True

    def _end_cycling(self) -> None:
        """Hand the frames that come, and the master's heartbeat, back to the network."""
        self._reader.take = self.network.take
        self._cycling = False
        self.network.release_cycle()

    def _forget_irregularities(self) -> None:
        self._floats[codec.IRREGULAR] = 0.0
        self._ints[codec.FRAMES] = self._ints[codec.FLOOD] = self._ints[codec.EXTRA] = 0


def has_deadline(axis: AxisConfig) -> bool:
    """Return whether the drive watches for RPDOs that are late (1400h:05)."""
    return any(pdo.event_timer_s > 0.0 for pdo in axis.drive.rpdos)

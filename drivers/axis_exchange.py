"""The cyclic exchange of n axes on one bus: SYNC out, feedback in, commands out."""

from __future__ import annotations

import select
import time
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from drivers import axis_codec as codec
from drivers.axis_alarms import alarm_text
from drivers.axis_layout import AxisConfig, GroupLayout
from drivers.axis_state import GroupState, StateArrays
from drivers.bus import BusUrl, FrameBuffer, open_port
from drivers.bus.packed import FRAME
from drivers.cia402 import CONTROLWORD_TABLE, STATE_TABLE
from drivers.network import CanNetwork

_SYNC_ID, _HEARTBEAT_ID = 0x080, 0x700
_OPERATIONAL_STATE = 5
# lockstep: for all axes, as their simulator may be held up; for one that is alone in not answering,
# less than bus time stands still; and for one that has not answered last time
_PATIENCE_S, _PATIENCE_WITH_ONE_S, _SHORT_PATIENCE_S = 2.0, 0.4, 0.02
_PACED_SHARE = 0.75
_FRAMES_PER_AXIS, _SPARE_FRAMES = 8, 64
_LATE_PASSES = 8


class AxisExchange:
    """What happens every cycle; nothing here allocates, waits for a lock or logs.

    `room` is where the state lies when these axes are part of a larger device.
    Raises BusError when the bus cannot be opened or goes away.
    """

    def __init__(
        self,
        url: BusUrl,
        network: CanNetwork,
        axes: Sequence[AxisConfig],
        period_s: float,
        master_node_id: int,
        heartbeat_s: float,
        room: StateArrays | None = None,
    ) -> None:
        self.axes = tuple(axes)
        self.n = len(self.axes)
        self.period_s = period_s
        self.paced_wait_s = _PACED_SHARE * period_s
        self.network = network
        self._layout = GroupLayout(self.axes)
        self._tx_bytes = _as_bytes(self._layout.rpdos)
        self._rx = FrameBuffer(_FRAMES_PER_AXIS * self.n + _SPARE_FRAMES)
        self._rx_bytes = _as_bytes(self._rx)
        self._sync_frame = FRAME.pack(_SYNC_ID, 0, bytes(8))
        operational = bytes([_OPERATIONAL_STATE]) + bytes(7)
        self._heartbeat_frame = FRAME.pack(_HEARTBEAT_ID + master_node_id, 1, operational)
        # by the clock of the bus: cycles that are held up are fewer, not slower heartbeats
        self._heartbeat_every_s = heartbeat_s - 0.5 * period_s
        self._heartbeat_at_s = 0.0
        filters = [(i, 0x7FF) for i in self._layout.identifiers]
        self._port = open_port(url, filters, network.health)
        self.lockstep = url.asks_for_lockstep or self._port.status.get("mode") == "lockstep"
        waiting = select.poll()
        waiting.register(self._port, select.POLLIN)
        self._waiting = waiting.poll
        self._port.settimeout(0.0)
        self._be_patient(True)
        self._cycling = self._closed = False
        self._late = False
        self.waits = 0
        """How often a frame was waited for, in paced cycles."""
        self._alarms = 0
        state = GroupState(self.axes, period_s, self.lockstep, room)
        self._ints, self._floats = state.ints, state.floats
        self._words, self._flags = state.words, state.flags
        self.feedback, self.command = state.feedback, state.command
        self._valid = state.feedback.valid
        self._seen = state.ints[codec.SEEN]
        self._compile(None if room is None else room.spare())

    def _compile(self, room: StateArrays | None) -> None:
        """Have the kernels compiled now: a first cycle of seconds would be a silent master."""
        layout = self._layout
        spare = GroupState(self.axes, self.period_s, self.lockstep, room)
        arrays = spare.ints, spare.floats
        codec.decode(
            self._rx_bytes, 0, 0, layout.slots, layout.fields, STATE_TABLE,
            *arrays, spare.words, spare.flags,
        )  # fmt: skip
        frames = np.zeros_like(self._tx_bytes)
        codec.end_answers(*arrays, spare.flags)
        codec.encode(frames, layout.answer, CONTROLWORD_TABLE, *arrays)

    def sync(self) -> None:
        """Send the SYNC that opens the cycle."""
        if not self._cycling:
            self._begin_cycling()
        if self._waiting(0):
            self._take_late()
        if self._late:
            self._late = False
            self._be_patient(False)
        elif self._impatient:
            self._be_patient(True)
        feedback = self.feedback
        feedback.cycle += 1
        feedback.time_s = feedback.cycle * self.period_s
        self._valid.fill(False)
        self._seen.fill(0)
        try:
            self._port.send(self._sync_frame)
        except OSError as error:
            raise self._port.lost(error) from error

    def receive(self, deadline_s: float = 0.0) -> int:
        """Wait for the answers to this SYNC and decode them; return how many axes answered.

        In lockstep an axis that falls silent is waited for up to 0.4 s of wall time, during which
        bus time stands, and where none answers up to 2 s. Otherwise the wait ends at `deadline_s`
        (monotonic), by default so that a share of the period is left for computing and sending.
        """
        if self.lockstep:
            answered = self._receive_in_lockstep()
        else:
            answered = self._receive_paced(deadline_s or time.monotonic() + self.paced_wait_s)
        self._alarms = codec.end_answers(self._ints, self._floats, self._flags)
        return answered

    def _receive_in_lockstep(self) -> int:
        recv_into, rows = self._port.recv_into, self._rx.rows
        missing, since_s = self.n, 0.0
        while missing:
            last, timed_out = 0, False
            try:
                for row in rows[:missing]:
                    if not recv_into(row):
                        raise self._port.lost()
                    last += 1
            except BlockingIOError:
                timed_out = True
            except OSError as error:
                raise self._port.lost(error) from error
            missing -= self._decode(0, last)
            if missing:
                # heartbeats go on when answers do not: each of them ends a wait of the port
                now = time.monotonic()
                since_s = since_s or now - timed_out * self._wait_s
                some = missing < self.n
                if now - since_s >= (self._wait_s if some else self._patience_s):
                    self._late = True
                    break
        return self.n - missing

    def _receive_paced(self, deadline: float) -> int:
        """Take in what has come; wait for more only while an axis has not answered."""
        recv_into, rows = self._port.recv_into, self._rx.rows
        missing = self.n
        while missing:
            last = 0
            try:
                for row in rows:
                    if not recv_into(row):
                        raise self._port.lost()
                    last += 1
            except BlockingIOError:
                pass
            except OSError as error:
                raise self._port.lost(error) from error
            if last:
                missing -= self._decode(0, last)
            left = deadline - time.monotonic()
            if left <= 0.0:
                self._late = missing > 0
                break
            if missing:
                self._wait(left)
        return self.n - missing

    def _wait(self, seconds: float) -> None:
        """Wait for a frame; the kernel's own receive time-out is too coarse for a cycle."""
        self.waits += 1
        select.select([self._port], [], [], seconds)

    def _take_late(self) -> None:
        """Decode what came after its cycle, so that it is not taken for the next one's answer.

        A flood is cut short: what is left of it is thrown away.
        """
        recv_waiting, rows = self._port.recv_waiting, self._rx.rows
        for _ in range(_LATE_PASSES):
            last = 0
            try:
                for row in rows:
                    if not recv_waiting(row):
                        raise self._port.lost()
                    last += 1
            except BlockingIOError:
                if last:
                    self._decode(0, last)
                return
            except OSError as error:
                raise self._port.lost(error) from error
            self._decode(0, last)
        self._port.drain()

    def _be_patient(self, patient: bool) -> None:
        self._impatient = not patient
        self._patience_s = _PATIENCE_S if patient else _SHORT_PATIENCE_S
        self._wait_s = _PATIENCE_WITH_ONE_S if patient else _SHORT_PATIENCE_S
        if self.lockstep:
            self._port.settimeout(self._wait_s)

    def _decode(self, first: int, last: int) -> int:
        layout = self._layout
        return codec.decode(
            self._rx_bytes,
            first,
            last,
            layout.slots,
            layout.fields,
            STATE_TABLE,
            self._ints,
            self._floats,
            self._words,
            self._flags,
        )

    def transmit(self) -> None:
        """Send controlwords and torques, to act from the next SYNC on.

        A torque that is not a finite number goes out as zero and raises the alarm.
        """
        layout = self._layout
        self._alarms = codec.encode(
            self._tx_bytes,
            layout.answer,
            CONTROLWORD_TABLE,
            self._ints,
            self._floats,
        )
        send = self._port.send
        try:
            for row in layout.rpdos.rows:
                send(row)
            now_s = self.feedback.time_s if self.lockstep else time.monotonic()
            if now_s >= self._heartbeat_at_s:
                self._heartbeat_at_s = now_s + self._heartbeat_every_s
                send(self._heartbeat_frame)
        except OSError as error:
            raise self._port.lost(error) from error

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
        self.network.claim_cycle()
        self._heartbeat_at_s = 0.0  # the last one between cycles may be a whole period ago
        for axis in self.axes:
            if has_deadline(axis):
                self.network.start(axis.node_id, axis.drive.heartbeat_producer_s)
        self._port.drain()
        for i, axis in enumerate(self.axes):
            if axis.node_id in self.network.restarted:
                # while no cycles ran, and for good: only a new boot makes it usable again
                self._flags[codec.INDEX_KNOWN, i] = False
                self._ints[codec.ALARM, i] |= codec.RESTARTED
        self._ints[codec.HEARTBEAT_AGE] = 0
        self._forget_irregularities()
        self._cycling = True

    def _forget_irregularities(self) -> None:
        self._floats[codec.IRREGULAR] = 0.0
        self._ints[codec.FRAMES] = self._ints[codec.FLOOD] = self._ints[codec.EXTRA] = 0


def _as_bytes(buffer: FrameBuffer) -> NDArray[np.uint8]:
    return buffer.array.view(np.uint8).reshape(-1, 16)


def has_deadline(axis: AxisConfig) -> bool:
    """Return whether the drive watches for RPDOs that are late (1400h:05)."""
    return any(pdo.event_timer_s > 0.0 for pdo in axis.drive.rpdos)

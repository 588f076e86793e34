"""Axes that another master runs: their feedback is taken in, and not one frame is sent."""

from __future__ import annotations

import math
import select
import time
from collections.abc import Sequence
from dataclasses import dataclass
from types import TracebackType
from typing import Self

import numpy as np

from cdpr_rt.clock import PacedClock
from cdpr_rt.exchange import AxisCommand, AxisFeedback, BoolArray
from drivers import axis_codec as codec
from drivers.axis_alarms import alarm_text
from drivers.axis_buses import Moves
from drivers.axis_layout import AxisConfig, GroupLayout
from drivers.axis_state import GroupState, StateArrays
from drivers.bus import BusHealth, BusUrl, FrameBuffer, open_port
from drivers.cia402 import STATE_TABLE, State
from profiles import Winch

_SYNC_ID = 0x080
_SYNC_HEAD = bytes([_SYNC_ID, 0, 0, 0])
_TURN_S = 0.05
"""How long one cycle waits for a SYNC before it ends without."""
_PAUSE_S = 0.5
"""After so long without a SYNC a new beginning is made with the next."""
_SHARE = 1.0
_LOCKSTEP_WAIT_S = 0.2
_CALM_SHARE = 0.25
"""Of a period after a cycle's answers: by then its SYNC has come on all buses."""
_CYCLES_APART = 8
_FRAMES_PER_AXIS, _SPARE_FRAMES = 8, 64
_OWN_DOING = codec.WRONG_MODE | codec.LEFT_ENABLED
"""Alarms about what the other master asks of its drives, which is its own affair."""


@dataclass(frozen=True)
class HeardBus:
    """The axes on one bus; `places` are their numbers in the whole device, 0 to n - 1."""

    name: str
    url: BusUrl
    axes: Sequence[AxisConfig]
    places: Sequence[int]


def heard_axis(winch: Winch, node_id: int) -> AxisConfig:
    """Return the axis of a drive that cannot be asked: what its profiles say has to do."""
    motor = winch.motor
    torque_Nm = motor.rated_torque_Nm
    return AxisConfig(node_id, winch.drive, torque_Nm, winch.encoder_counts_per_turn, 0, torque_Nm)


class ListeningDevice:
    """n axes on several buses, heard only; implements `cdpr_rt.exchange.AxisDevice`.

    Time comes from the SYNC of the master that runs them: `sync` waits for the next one, for a
    moment only where none comes. The cycles of further buses are matched to those of the first,
    again also after some were lost. Torques are in the unit that the profiles say, since the
    drives are not asked for their rated torque.

    Raises BusError when a bus cannot be opened, and DriverError for a PDO map that does not serve
    torque control.
    """

    lockstep = True
    """The next cycle begins when the other master's does, not at a deadline of ours."""

    def __init__(self, buses: Sequence[HeardBus], period_s: float, clock: PacedClock) -> None:
        self.buses = tuple(buses)
        self.period_s = period_s
        self.clock = clock
        order = [place for bus in buses for place in bus.places]
        self.n = len(order)
        room = StateArrays(self.n)
        self._ears: list[_Ear] = []
        first = 0
        try:
            for bus in buses:
                part = room.part(first, first + len(bus.axes))
                self._ears.append(_Ear(bus, period_s, part))
                first += len(bus.axes)
        except BaseException:
            self.close()
            raise
        self.feedback: AxisFeedback = room.feedback()
        self.command: AxisCommand = room.command()
        self._moves = Moves(order, self.feedback, self.command)
        if self._moves.needed:
            self.feedback, self.command = self._moves.feedback, self._moves.command
        self._columns = np.argsort(np.array(order, np.intp))
        self._calm_s = _CALM_SHARE * period_s
        self._apart = 0
        self._heard = False
        self._heard_s = -math.inf  # no master yet

    @property
    def silent_s(self) -> float:
        """Return for how long no SYNC has come."""
        return self.clock.now_s - self._heard_s

    # -- one cycle

    def sync(self) -> None:
        """Wait for the SYNC of the other master; raises BusError when a bus is gone."""
        first, *others = self._ears
        if others:
            self._match()
        self._heard = first.hear_sync(time.monotonic() + _TURN_S)
        if not self._heard:
            for ear in self._ears:
                ear.valid.fill(False)
            return
        now = time.monotonic()
        if now - self._heard_s > _PAUSE_S:
            self.forget_alarms()
        self._heard_s = now
        for ear in others:
            ear.hear_sync(now + ear.wait_s)
        self.feedback.cycle += 1
        self.feedback.time_s = self.feedback.cycle * self.period_s

    def receive(self) -> int:
        """Take in the answers to the SYNC; return how many axes answered. Raises BusError."""
        answered = 0
        if self._heard:
            for ear in self._ears:
                answered += ear.hear_answers(time.monotonic() + ear.wait_s)
                ear.end_cycle()
        if self._moves.needed:
            self._moves.gather()
        return answered

    def _match(self) -> None:
        """Leave out a cycle of those buses that are ahead of others, which have lost one.

        Now and then it is chance, since SYNC does not come on all buses at the same instant.
        """
        first = self._ears[0]
        ahead = self._ahead()
        if first not in ahead and not first.sync_is_there(time.monotonic() + self._calm_s):
            ahead = self._ahead()
        self._apart += 1 if 0 < len(ahead) < len(self._ears) else -1
        self._apart = max(self._apart, 0)
        if self._apart >= _CYCLES_APART:
            self._apart = 0
            for ear in ahead:
                ear.leave_out()

    def _ahead(self) -> list[_Ear]:
        return [ear for ear in self._ears if ear.sync_is_there()]

    def transmit(self) -> None:
        """Send nothing, whatever `command` says."""
        self.command.sent_torque_Nm.fill(0.0)

    def alarm(self) -> str:
        """Return what is wrong with an axis as far as it can be heard, or an empty text.

        That no master runs the axes is none; see `silent_s`.
        """
        for ear in self._ears:
            if ear.alarms:
                return f"bus {ear.name}: {alarm_text(ear.axes, ear.ints)}"
        return ""

    def forget_alarms(self) -> None:
        """Forget latched alarms."""
        for ear in self._ears:
            ear.forget_alarms()

    # -- what is known of the axes

    def states(self) -> list[State]:
        """Return the state each axis reported last."""
        return [State(int(state)) for state in self._row(codec.STATE)]

    def faulted(self) -> BoolArray:
        """Return which axes have been in fault since alarms were forgotten, (n,)."""
        return np.asarray(self._row(codec.FAULTED) != 0)

    @property
    def missed(self) -> int:
        """Answers that were not heard since the beginning, over all axes."""
        return int(sum(ear.ints[codec.MISSED].sum() for ear in self._ears))

    def _row(self, row: int) -> codec.Ints:
        return np.concatenate([ear.ints[row] for ear in self._ears])[self._columns]

    # -- the end

    def close(self) -> str:
        """Leave the buses; there is nothing to be unsure of."""
        for ear in self._ears:
            ear.close()
        return ""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


class _Ear:
    """One bus: its port, of which only the receiving half is used, and the state of its axes."""

    def __init__(self, bus: HeardBus, period_s: float, room: StateArrays) -> None:
        self.name = bus.name
        self.axes = tuple(bus.axes)
        self.health = BusHealth()
        self.alarms = 0
        self._layout = layout = GroupLayout(self.axes)
        state = GroupState(self.axes, period_s, False, room)
        self.ints, self._floats, self._words, self._flags = (
            state.ints, state.floats, state.words, state.flags,
        )  # fmt: skip
        self.valid = state.feedback.valid
        self._seen = state.ints[codec.SEEN]
        self._rx = FrameBuffer(_FRAMES_PER_AXIS * len(self.axes) + _SPARE_FRAMES)
        self._others = np.zeros(len(self._rx.rows) + 1, np.int64)
        self._missing = 0
        self._sync_waits = False
        self._compile()
        filters = [(i, 0x7FF) for i in (_SYNC_ID, *layout.identifiers)]
        self._port = open_port(bus.url, filters, self.health)
        held = bus.url.asks_for_lockstep or self._port.status.get("mode") == "lockstep"
        self.wait_s = _LOCKSTEP_WAIT_S if held else _SHARE * period_s
        self._port.settimeout(0.0)
        self._port.drain()

    def _compile(self) -> None:
        """Have the kernels compiled before there is a cycle to be late for."""
        self._decode(0, 0)
        self.end_cycle()
        self.ints[codec.MISSED] = self.ints[codec.SILENT_CYCLES] = 0
        self.forget_alarms()

    def forget_alarms(self) -> None:
        """Forget latched alarms and what irregularities have been noted."""
        for row in (codec.ALARM, codec.FAULTED, codec.SILENT_CYCLES, codec.HEARTBEAT_AGE):
            self.ints[row] = 0
        for row in (codec.FRAMES, codec.FLOOD, codec.EXTRA, codec.EMERGENCY):
            self.ints[row] = 0
        self._floats[codec.IRREGULAR] = 0.0
        # the first index that the other master latches is taken for the axis' own
        known = self._flags[codec.INDEX_KNOWN]
        self.ints[codec.PROBE_ARMED] = self._layout.probe_mapped & ~known
        self.alarms = 0

    def sync_is_there(self, deadline: float = 0.0) -> bool:
        """Take in what waits, or comes until `deadline`; return whether the next SYNC is there."""
        if not self._sync_waits:
            self._sync_waits = self._listen(deadline)
        return self._sync_waits

    def leave_out(self) -> None:
        """Pass over the SYNC that is there; the answers to it come too late then."""
        self._sync_waits = False

    def hear_sync(self, deadline: float) -> bool:
        """Wait for the next SYNC and begin its cycle; return whether it came in time."""
        self.valid.fill(False)
        if not self._sync_waits and not self._listen(deadline):
            return False
        self._sync_waits = False
        self._seen.fill(0)
        self._missing = len(self.axes)
        return True

    def hear_answers(self, deadline: float) -> int:
        """Take in answers until all have come, time is up or the next SYNC; return how many."""
        wanted = self._missing
        if wanted:
            self._sync_waits = self._listen(deadline)
        answered, self._missing = wanted - self._missing, 0
        return answered

    def _listen(self, deadline: float) -> bool:
        """Take in frames until a SYNC (true), the last answer awaited, or `deadline` (false).

        While answers are awaited, their coming ends it as well; 0 for what waits already.
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
                self._missing -= min(self._decode(0, last), self._missing)
            if came or (awaited and not self._missing):
                return came
            left = deadline - time.monotonic()
            if left <= 0.0:
                return False
            if last < len(rows):
                select.select([self._port], [], [], left)

    def _decode(self, first: int, last: int) -> int:
        layout = self._layout
        return codec.decode(
            self._rx.bytes,
            first,
            last,
            layout.slots,
            layout.fields,
            STATE_TABLE,
            self.ints,
            self._floats,
            self._words,
            self._flags,
            self._others,
        )

    def end_cycle(self) -> None:
        """Count who was silent, irregular or without heartbeat."""
        codec.end_answers(self.ints, self._floats, self._flags)
        alarms = self.ints[codec.ALARM]
        alarms &= ~_OWN_DOING
        self.alarms = int(np.bitwise_or.reduce(alarms))

    def close(self) -> None:
        """Leave the bus."""
        self._port.close()

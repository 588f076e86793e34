"""Monitors by SDO, without booting any drive, whether one on a bus has power."""

from __future__ import annotations

from collections.abc import Collection
from typing import Final

from cdpr_drivers.bus import BusUrl, open_port
from cdpr_drivers.bus.frame_reader import FrameReader
from cdpr_drivers.bus.frames import FRAME
from cdpr_drivers.canopen import sdo_frames as frames
from cdpr_drivers.cia402 import POWER_OFF, state_of
from cdpr_rt.core.clock import Clock

_FUNCTION: Final = 0x780
_UPLOAD: Final = frames.upload_request(0x6041, 0)
_STATUSWORD: Final = frames.multiplexer(0x6041, 0)
_ROUNDS: Final = 2
_WAIT_S: Final = 0.2
"""How long answers are awaited after the last request."""
_ASK_EVERY_S: Final = 0.25
_ANSWER_TIMEOUT_S: Final = 2.0


class PowerWatch:
    """Polls the statuswords (6041h) of all drives on a bus except `exclude`.

    Nodes that do not answer, or refuse, are no drives with power: their control supply is off, or
    they are something else. Methods raise BusError.
    """

    def __init__(self, url: BusUrl, clock: Clock, exclude: Collection[int]) -> None:
        """Ask all node ids, and wait for the answers."""
        self.url = url
        self._clock = clock
        self._exclude = frozenset(exclude)
        self._heard_s: dict[int, float] = {}
        self._words: dict[int, int] = {}
        self._reader = FrameReader(open_port(url, [(frames.ANSWER, _FUNCTION)]))
        self._reader.take = self._take
        try:
            for _ in range(_ROUNDS):
                self._ask([node for node in range(1, 128) if node not in exclude])
                clock.sleep(_WAIT_S)
                self._reader.settle()
        except BaseException:
            self._reader.close()
            raise
        self._asked_at_s = clock.now_s

    @property
    def nodes(self) -> list[int]:
        """The drives that have answered."""
        return sorted(self._words)

    def reason(self) -> str:
        """Return which drive has power, or has stopped answering, or an empty text; never waits."""
        now_s = self._clock.now_s
        self._reader.settle()
        if now_s - self._asked_at_s > _ASK_EVERY_S:
            self._asked_at_s = now_s
            self._ask(self.nodes)
        for node, word in sorted(self._words.items()):
            state = state_of(word)
            if state not in POWER_OFF:
                return f"node {node} on {self.url} is {state.label}, which is with power"
            if now_s - self._heard_s[node] > _ANSWER_TIMEOUT_S:
                return f"node {node} on {self.url} does not answer any more: has it power?"
        return ""

    def close(self) -> None:
        """Leave the bus."""
        self._reader.close()

    def _ask(self, nodes: Collection[int]) -> None:
        port = self._reader.port
        try:
            for node in nodes:
                port.send(FRAME.pack(frames.REQUEST + node, 8, _UPLOAD))
        except OSError as error:
            raise port.lost(error) from error

    def _take(self, last: int) -> None:
        for row in self._reader.frames.rows[:last]:
            can_id, length, data = FRAME.unpack_from(row)
            node = can_id - frames.ANSWER
            if node in self._exclude:
                continue  # answers to the master that runs them
            # other transfers on the bus are ignored
            if frames.answers(data[:length], _STATUSWORD, frames.UPLOAD):
                value = frames.expedited(data)
                if value is not None:
                    self._words[node] = int.from_bytes(value[:2], "little")
                    self._heard_s[node] = self._clock.now_s

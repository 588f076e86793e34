"""Whether any drive of a bus has power, asked of all of them by SDO without booting one."""

from __future__ import annotations

import struct
from collections.abc import Collection
from typing import Final

from cdpr_rt.clock import Clock
from drivers.bus import BusUrl, open_port
from drivers.bus.intake import Intake
from drivers.bus.packed import FRAME
from drivers.cia402 import POWER_OFF, state_of

_REQUEST, _ANSWER, _FUNCTION = 0x600, 0x580, 0x780
_UPLOAD: Final = struct.pack("<BHB4x", 0x40, 0x6041, 0)
_UPLOADED: Final = struct.pack("<HB", 0x6041, 0)
_ROUNDS: Final = 2
_WAIT_S: Final = 0.2
"""How long answers are waited for after the last question."""
_ASK_EVERY_S: Final = 0.25
_SILENCE_S: Final = 2.0


class PowerWatch:
    """The statuswords (6041h) of all drives on a bus but the `but` ones.

    Nodes that do not answer, or refuse, are no drives with power: their control supply is off, or
    they are something else. Methods raise BusError.
    """

    def __init__(self, url: BusUrl, clock: Clock, but: Collection[int]) -> None:
        """Ask everybody, and wait for the answers."""
        self.url = url
        self._clock = clock
        self._but = frozenset(but)
        self._heard_s: dict[int, float] = {}
        self._words: dict[int, int] = {}
        self._intake = Intake(open_port(url, [(_ANSWER, _FUNCTION)]))
        self._intake.take = self._take
        try:
            for _ in range(_ROUNDS):
                self._ask([node for node in range(1, 128) if node not in but])
                clock.sleep(_WAIT_S)
                self._intake.settle()
        except BaseException:
            self._intake.close()
            raise
        self._asked_at_s = clock.now_s

    @property
    def nodes(self) -> list[int]:
        """The drives that have answered."""
        return sorted(self._words)

    def reason(self) -> str:
        """Return which drive has power, or has stopped answering, or an empty text; never waits."""
        now_s = self._clock.now_s
        self._intake.settle()
        if now_s - self._asked_at_s > _ASK_EVERY_S:
            self._asked_at_s = now_s
            self._ask(self.nodes)
        for node, word in sorted(self._words.items()):
            state = state_of(word)
            if state not in POWER_OFF:
                return f"node {node} on {self.url} is {state.label}, which is with power"
            if now_s - self._heard_s[node] > _SILENCE_S:
                return f"node {node} on {self.url} does not answer any more: has it power?"
        return ""

    def close(self) -> None:
        """Leave the bus."""
        self._intake.close()

    def _ask(self, nodes: Collection[int]) -> None:
        port = self._intake.port
        try:
            for node in nodes:
                port.send(FRAME.pack(_REQUEST + node, 8, _UPLOAD))
        except OSError as error:
            raise port.lost(error) from error

    def _take(self, last: int) -> None:
        for row in self._intake.frames.rows[:last]:
            can_id, length, data = FRAME.unpack_from(row)
            node = can_id - _ANSWER
            if node in self._but:
                continue  # they answer whoever drives them
            # an expedited answer with 6041h: anybody's other transfers are left aside
            if length == 8 and data[0] & 0xE2 == 0x42 and data[1:4] == _UPLOADED:
                self._words[node] = int.from_bytes(data[4:6], "little")
                self._heard_s[node] = self._clock.now_s

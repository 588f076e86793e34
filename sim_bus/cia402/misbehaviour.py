"""Misbehaviour on command (2F00h), so that a master's answers to it can be tested over the bus."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from sim_bus.canopen.datatypes import Value
from sim_bus.canopen.od import ObjectDictionary
from sim_bus.cia402.machine import Machine

_RAISE_FAULT, _DROP_TPDOS, _REFUSE_MODES, _SHOW_MODE, _MUTE_HEARTBEAT = 1, 2, 3, 4, 5
_DEFAULT_TPDO = (0x180, 0x280, 0x380, 0x480)


class Misbehaviour:
    """Object 2F00h, which no real drive has."""

    def __init__(self, od: ObjectDictionary, machine: Machine, outbox: list[bytes]) -> None:
        self._od = od
        self._machine = machine
        self._outbox = outbox
        self._drops = 0
        self._muted = False
        self.active = False
        """Whether frames of the outbox must be dropped."""
        writers: dict[int, Callable[[Any], None]] = {
            _RAISE_FAULT: self._raise_fault,
            _DROP_TPDOS: self._set_drops,
            _REFUSE_MODES: self._refuse_modes,
            _SHOW_MODE: self._show_mode,
            _MUTE_HEARTBEAT: self._mute,
        }
        for sub, writer in writers.items():
            od.on_write(0x2F00, sub, writer)

    def reset(self) -> None:
        """Behave again."""
        self._set_drops(0)
        self._mute(0)
        self._refuse_modes(0)
        self._show_mode(0)

    def spoil_outbox(self) -> None:
        """Take out of the outbox what is to be dropped."""
        kept = [frame for frame in self._outbox if not self._drop(frame)]
        self._outbox[:] = kept
        self._od.set(0x2F00, _DROP_TPDOS, self._drops)

    def _drop(self, frame: bytes) -> bool:
        identifier = int.from_bytes(frame[:4], "little")
        if self._muted and identifier & 0x780 == 0x700:
            return True
        if self._drops and identifier & 0x780 in _DEFAULT_TPDO:
            self._drops -= 1
            self.active = self._drops > 0 or self._muted
            return True
        return False

    def _raise_fault(self, code: Value) -> None:
        if code:
            self._machine.trip(int(code))

    def _set_drops(self, count: Value) -> None:
        self._drops = int(count)
        self.active = self._drops > 0 or self._muted

    def _mute(self, on: Value) -> None:
        self._muted = bool(on)
        self.active = self._drops > 0 or self._muted

    def _refuse_modes(self, how: Value) -> None:
        self._machine.ignore_modes = int(how)

    def _show_mode(self, mode: Value) -> None:
        self._machine.shown_mode = int(mode)
        self._machine.update()

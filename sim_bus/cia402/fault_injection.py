"""Fault injection by object 2F00h, to test a master's reactions over the bus."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from cdpr_sim_bus.canopen.abort import Abort, SdoAbort
from cdpr_sim_bus.canopen.dictionary.datatypes import Value
from cdpr_sim_bus.canopen.dictionary.od import ObjectDictionary
from cdpr_sim_bus.cia402.state_machine import StateMachine
from cdpr_sim_bus.frame import pack_frame

_RAISE_FAULT, _DROP_TPDOS, _REFUSE_MODES, _SHOW_MODE, _MUTE_HEARTBEAT = 1, 2, 3, 4, 5
_FALL_SILENT, _DOUBLE_TPDOS, _DELAY_TPDOS, _BABBLE, _VANISH_IN_SDO = 6, 7, 8, 9, 10
_JUMP, _CUT_CABLE, _SLIP, _CELL_OFF = 11, 12, 13, 14
_COUNTED = (_DROP_TPDOS, _DOUBLE_TPDOS, _DELAY_TPDOS, _VANISH_IN_SDO)
_DEFAULT_TPDO = (0x180, 0x280, 0x380, 0x480)
_ERROR_CONTROL, _SDO_ANSWER, _EMCY = 0x700, 0x580, 0x080
_FUNCTION, _NODE = 0x780, 0x07F
_FOR_GOOD_MS = 0xFFFF
_BABBLE_FRAME = b"\x00\xff\x81BABBL"
"""EMCY FF00h (device specific)."""


class FaultInjection:
    """Object 2F00h, which no real drive has; an EDS may lack it, or some of its sub-indexes."""

    def __init__(
        self, od: ObjectDictionary, state_machine: StateMachine, outbox: list[bytes]
    ) -> None:
        self._od = od
        self._state_machine = state_machine
        self._axis = state_machine.axis
        self._outbox = outbox
        self._left = dict.fromkeys(_COUNTED, 0)
        """How many more frames each of the counted faults affects."""
        self._late: list[bytes] = []
        self._muted = False
        self._babble = 0
        self._last_babble_ms = 0
        self._now = 0.0
        self._silent_until = 0.0
        self._silence_ms = _FOR_GOOD_MS
        self.active = False
        """Whether frames of the outbox have to be altered."""
        writers: dict[int, Callable[[Any], None]] = {
            _RAISE_FAULT: self._raise_fault,
            _REFUSE_MODES: self._refuse_modes,
            _SHOW_MODE: self._show_mode,
            _MUTE_HEARTBEAT: self._mute,
            _FALL_SILENT: self._silence_after_the_answer,
            _BABBLE: self._set_babble,
            _JUMP: lambda counts: self._axis.jump(int(counts)),
            _CUT_CABLE: self._cut_cable,
            _SLIP: self._slip,
            _CELL_OFF: self._set_cell_off,
        }
        writers |= {sub: self._counter(sub) for sub in _COUNTED}
        for sub, writer in writers.items():
            if (0x2F00, sub) in od:
                od.on_write(0x2F00, sub, writer)

    def reset(self) -> None:
        """End all faults."""
        self._left = dict.fromkeys(_COUNTED, 0)
        self._late.clear()
        self._muted = False
        self._babble = 0
        self._refuse_modes(0)
        self._show_mode(0)
        self._update_active()

    def is_silent(self, now: float) -> bool:
        """Return whether the drive neither receives nor sends at bus time `now`."""
        return now < self._silent_until

    def alter_outbox(self, now: float) -> None:
        """Drop, delay, double or add frames of the outbox, as the active faults ask for."""
        self._now = now
        if now < self._silent_until:
            self._outbox.clear()
            return
        self._do_babble()
        frames, late = list(self._outbox), self._late
        self._outbox.clear()
        for frame in frames:
            if late and _is_tpdo(frame):
                # the frame held back comes before the one that is on time
                self._outbox += late
                late.clear()
            self._filter_frame(frame)
        for sub, count in self._left.items():
            if (0x2F00, sub) in self._od:
                self._od.set(0x2F00, sub, count)
        self._update_active()

    def _filter_frame(self, frame: bytes) -> None:
        identifier = int.from_bytes(frame[:4], "little")
        if self._muted and identifier & _FUNCTION == _ERROR_CONTROL:
            return
        if identifier & _FUNCTION == _SDO_ANSWER and self._consume(_VANISH_IN_SDO):
            if not self._left[_VANISH_IN_SDO]:
                self._fall_silent()
        elif _is_tpdo(frame):
            if self._consume(_DROP_TPDOS):
                return
            if self._consume(_DELAY_TPDOS):
                self._late.append(frame)
                return
            if self._consume(_DOUBLE_TPDOS):
                self._outbox.append(frame)
        self._outbox.append(frame)

    def _consume(self, sub: int) -> bool:
        if not self._left[sub]:
            return False
        self._left[sub] -= 1
        return True

    def _do_babble(self) -> None:
        ms = int(self._now * 1e3)
        if self._babble and ms != self._last_babble_ms:
            self._last_babble_ms = ms
            node_id = self._od.get_int(0x1014, 0, _EMCY) & _NODE
            self._outbox += [pack_frame(_EMCY + node_id, _BABBLE_FRAME)] * self._babble

    def _update_active(self) -> None:
        self.active = bool(
            any(self._left.values())
            or self._late
            or self._muted
            or self._babble
            or self._now < self._silent_until
        )

    def _counter(self, sub: int) -> Callable[[Value], None]:
        def set_count(count: Value) -> None:
            self._left[sub] = int(count)
            if count and sub == _VANISH_IN_SDO:
                self._left[sub] += 1  # the answer to the SDO that asks for it is not meant
                self._silence_ms = _FOR_GOOD_MS
            self._update_active()

        return set_count

    def _raise_fault(self, code: Value) -> None:
        if code:
            self._state_machine.trip(int(code))

    def _cut_cable(self, cut: Value) -> None:
        if cut and not self._axis.cut_cable():
            raise SdoAbort(Abort.HARDWARE_ERROR)

    def _slip(self, millimetres: Value) -> None:
        if millimetres and not self._axis.slip_cable(int(millimetres) * 1e-3):
            raise SdoAbort(Abort.HARDWARE_ERROR)

    def _set_cell_off(self, newton: Value) -> None:
        self._axis.cell_off_N = float(newton)

    def _mute(self, on: Value) -> None:
        self._muted = bool(on)
        self._update_active()

    def _set_babble(self, frames_per_ms: Value) -> None:
        self._babble = int(frames_per_ms)
        self._update_active()

    def _silence_after_the_answer(self, ms: Value) -> None:
        self._silence_ms = int(ms)
        self._left[_VANISH_IN_SDO] = 1
        self._update_active()

    def _fall_silent(self) -> None:
        ms = self._silence_ms
        self._silent_until = self._now + (math.inf if ms == _FOR_GOOD_MS else ms * 1e-3)

    def _refuse_modes(self, how: Value) -> None:
        self._state_machine.ignore_modes = int(how)

    def _show_mode(self, mode: Value) -> None:
        self._state_machine.displayed_mode = int(mode)
        self._state_machine.update()


def _is_tpdo(frame: bytes) -> bool:
    return int.from_bytes(frame[:4], "little") & _FUNCTION in _DEFAULT_TPDO

"""Faults of a simulated drive and its robot: their table, and object 2F00h."""

from __future__ import annotations

import math
import random
import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from cdpr_sim_bus.canopen.abort import Abort, SdoAbort
from cdpr_sim_bus.canopen.node import CanopenSlave
from cdpr_sim_bus.canopen.od import Value
from cdpr_sim_bus.canopen.slave import NmtState
from cdpr_sim_bus.cia402.state_machine import StateMachine
from cdpr_sim_bus.cia402.words import ErrorCode, error_register_bits
from cdpr_sim_bus.frame import pack_frame
from cdpr_sim_bus.physics_board import BoardAxis, SafetyIoFault, TensionFault
from cdpr_sim_bus.robot.cable_robot import CableRobot

_REFUSE_MODES, _SHOW_MODE, _FALL_SILENT, _VANISH_IN_SDO = 3, 4, 6, 10
_DEFAULT_TPDO = (0x180, 0x280, 0x380, 0x480)
_ERROR_CONTROL, _SDO_ANSWER, _SDO_REQUEST, _EMCY = 0x700, 0x580, 0x600, 0x080
_FUNCTION, _DATA_AT = 0x780, 8
_FOR_GOOD_MS = 0xFFFF
_EXPEDITED_MASK, _EXPEDITED = 0xE2, 0x22
"""First byte of an SDO: an expedited download, of any size."""
_NO_SILENCE = bytes.fromhex("002f0600000000")
"""The bytes after the first one of an SDO download of 0 to 2F00h:6."""
_BABBLE_FRAME = b"\x00\xff\x81BABBL"
"""EMCY FF00h (device specific)."""


@dataclass(frozen=True)
class Fault:
    """One kind of fault; `apply` breaks a drive or its robot by an amount, and 0 mends it."""

    name: str
    meaning: str
    apply: Callable[[FaultInjection, Any], object]
    usual: float = 1
    least: float = 1
    most: float = 1
    unit: str = ""
    sub: int = 0
    """Sub-index of 2F00h by which a master can inject it; 0 without one."""
    needs: str = ""
    """What the robot must have: "cable", "platform", "space" (not in a plane), or a "board"."""
    lasts: bool = True
    """Whether the fault lasts until it is mended; other faults happen once."""
    left: Callable[[FaultInjection], float] | None = None
    """Returns the present amount of a fault that may also end without `mend`."""

    of_robot: bool = False
    """Whether it concerns the robot, not one axis."""

    def amount(self, value: float | None) -> float:
        """Return a valid amount, by default the usual one; raises ValueError."""
        amount = self.usual if value is None else value
        whole = all(isinstance(limit, int) for limit in (self.usual, self.least, self.most))
        if not self.least <= amount <= self.most or (whole and amount != int(amount)):
            kind = "whole numbers " if whole else ""
            raise ValueError(f"allowed: {kind}{self.least} to {self.most}")
        return int(amount) if whole else float(amount)

    def text(self, amount: float) -> str:
        """Return the fault and its amount with the unit."""
        if self.least == self.most:
            return self.name
        shown = f"{int(amount):#06x}" if self.unit == "code" else f"{amount:g} {self.unit}"
        return f"{self.name} {shown}"


MEND: Final = "mend"
"""Order that ends all lasting faults of an axis, or of the robot."""
CUT, SLIP, SILENCE, CELL_OFF = "cut-cable", "slip", "silence", "cell-off"
_LOST, _DOUBLED, _LATE = "frames-lost", "frames-doubled", "frames-late"
_CORRUPTED = "frames-corrupted"
_COUNTED = (_LOST, _DOUBLED, _LATE, _CORRUPTED)
_LONGEST_FRAME = 8


class FaultInjection:
    """The faults of one drive, and its object 2F00h; an EDS may lack all or part of that."""

    def __init__(self, state_machine: StateMachine, slave: CanopenSlave) -> None:
        self.state_machine, self.slave = state_machine, slave
        self.axis = state_machine.axis
        self._od, self._outbox = self.axis.od, slave.outbox
        self.counts = dict.fromkeys(_COUNTED, 0)
        """Remaining number of frames that each counted fault affects."""
        self.noted: Callable[[Fault, float], None] = lambda _fault, _amount: None
        """Called for each fault that is injected, with 0 when it is mended."""
        self._present: dict[str, float] = {}
        self._answers_left = 0
        self._late: list[bytes] = []
        self._muted = False
        self._babble = 0
        self._last_babble_ms = 0
        self._absent: set[str] = set()
        """Faults that keep the drive off the bus."""
        self._twin = False
        self._loss = 0.0
        self._chance = random.Random(slave.node_id)
        self.board: BoardAxis | None = None
        """The physics board, for faults of other devices."""
        self.mates: Sequence[FaultInjection] = (self,)
        """The drives on the same bus."""
        self._silent_until = 0.0
        self._silence_ms = _FOR_GOOD_MS
        self.active = False
        """Whether frames of the outbox must be altered."""
        writers: dict[int, Callable[[Any], None]] = {
            fault.sub: self._writer(fault) for fault in _TABLE if fault.sub
        } | {
            _REFUSE_MODES: self._refuse_modes,
            _SHOW_MODE: self._show_mode,
            _FALL_SILENT: self._silence_after_the_answer,
            _VANISH_IN_SDO: self._vanish_after,
        }
        for sub, writer in writers.items():
            if (0x2F00, sub) in self._od:
                self._od.on_write(0x2F00, sub, writer)
        for fault in _TABLE:
            if fault.left and fault.sub and (0x2F00, fault.sub) in self._od:
                self._od.on_read(0x2F00, fault.sub, self._reader(fault.left))

    # -- faults by their names

    def apply(self, fault: Fault, amount: float) -> None:
        """Inject a fault; the amount 0 mends it."""
        if amount == 0 and not fault.lasts:
            return
        fault.apply(self, amount)
        if fault.lasts:
            self._present[fault.name] = amount
        self._update_active()
        self.noted(fault, amount)

    def broken(self) -> dict[str, float]:
        """Return the faults that last, with their present amounts."""
        amounts = (
            (fault.name, float(fault.left(self)) if fault.left else self._present.get(name, 0.0))
            for name, fault in FAULTS.items()
            if fault.lasts
        )
        return {name: amount for name, amount in amounts if amount}

    def has(self, needed: str) -> bool:
        """Return whether the drive has what a fault needs."""
        body = self.axis.body
        if needed == "board":
            return self.board is not None
        if needed == "space":
            return body is not None and not body.platform["planar"][0]
        return self.axis.has_cable if needed == "cable" else not needed or body is not None

    def reset(self) -> None:
        """End the faults that a reset of the node ends."""
        for name in (*_COUNTED, "no-heartbeat", "emcy-flood"):
            if self._present.get(name):
                self.apply(FAULTS[name], 0)
        self._late.clear()
        self._answers_left = 0
        self._refuse_modes(0)
        self._show_mode(0)
        self._update_active()

    @property
    def silence_ms(self) -> float:
        """Time for which the drive stays silent."""
        left_s = self._silent_until - self.slave.now
        return _FOR_GOOD_MS if left_s == math.inf else max(0.0, round(left_s * 1e3, 6))

    @property
    def slipped_mm(self) -> int:
        """Length of cable that has slipped."""
        return min(round(self.axis.slipped_m * 1e3), 0xFFFF)

    def silence(self, ms: float) -> None:
        """Neither receive nor send for this time."""
        self._silent_until = self.slave.now + (math.inf if ms == _FOR_GOOD_MS else ms * 1e-3)
        self._present[SILENCE] = ms

    def set_absent(self, why: str, absent: object) -> None:
        """Leave the bus because of a fault, or return to it."""
        (self._absent.add if absent else self._absent.discard)(why)
        self._update_active()

    def lose_supply(self, lost: float) -> None:
        """Switch the drive off, or on again, as at power-up."""
        self.set_absent("drive-off", lost)
        if lost:
            self.slave.set_nmt_state(NmtState.INITIALISING)
            self.state_machine.restart()
        else:
            self.slave.reset_node()

    def bus_off(self, off: float) -> None:
        """Leave the bus, with the drive's reaction."""
        self.set_absent("bus-off", off)
        if off:
            self.state_machine.abort_connection(ErrorCode.BUS_OFF)

    def lose_bus(self, lost: float) -> None:
        """Cut all drives off the bus."""
        for mate in self.mates:
            mate.set_absent("bus-lost", lost)

    def lose_share(self, percent: float) -> None:
        """Lose this share of the TPDOs."""
        self._loss = percent / 100.0

    def double(self, doubled: float) -> None:
        """Let another device with the same node id boot and answer."""
        self._twin = bool(doubled)
        if doubled:
            self._outbox.append(pack_frame(_ERROR_CONTROL + self.slave.node_id, b"\x00"))

    def send_emcy(self, code: int) -> None:
        """Send an emergency message."""
        data = struct.pack("<HB5x", code, error_register_bits(code) | 1)
        self._outbox.append(pack_frame(_EMCY + self.slave.node_id, data))

    def ignore_commands(self, ignored: float) -> None:
        """Ignore the controlword."""
        self.state_machine.ignores_commands = bool(ignored)

    def set_motor(self, field: str, value: float) -> None:
        """Set a value of the motor's physics."""
        self.axis.motor[field] = value

    @property
    def body(self) -> CableRobot:
        """The robot with its platform."""
        assert self.axis.body is not None  # the fault needs it
        return self.axis.body

    def break_cell(self, fault: TensionFault, broken: float) -> None:
        """Give the load cell a fault, or mend it."""
        assert self.board is not None  # the fault needs it
        self.board.cell_fault = fault if broken else TensionFault.NONE

    def break_io(self, fault: SafetyIoFault, broken: float) -> None:
        """Give the safety I/O a fault, or mend it."""
        assert self.board is not None  # the fault needs it
        faults = self.board.io_faults
        self.board.io_faults = faults | fault if broken else faults & ~fault

    def count(self, name: str, frames: int) -> None:
        """Set the number of frames that a counted fault affects."""
        self.counts[name] = frames

    def mute(self, muted: float) -> None:
        """Send no heartbeat."""
        self._muted = bool(muted)

    def babble(self, frames_per_ms: int) -> None:
        """Send emergency messages all the time."""
        self._babble = frames_per_ms

    def set_cell_off(self, newton: float) -> None:
        """Let the load cell show this much more than the tension."""
        self.axis.cell_off_N = float(newton)

    # -- frames

    def is_silent(self, now: float) -> bool:
        """Return whether the drive neither receives nor sends at bus time `now`."""
        return bool(self._absent) or now < self._silent_until

    def ends_silence(self, frame: bytes, node_id: int) -> bool:
        """End the silence if this frame writes 0 to 2F00h:6; return whether it does.

        A silent drive receives no other frame. The size of the 0 does not matter.
        """
        kind = frame[_DATA_AT]
        zero = pack_frame(_SDO_REQUEST + node_id, bytes((kind,)) + _NO_SILENCE)
        if self._absent or kind & _EXPEDITED_MASK != _EXPEDITED or frame != zero:
            return False
        self.apply(FAULTS[SILENCE], 0)
        return True

    def alter_outbox(self, now: float) -> None:
        """Drop, delay, double or add frames of the outbox, as the active faults require."""
        if self.is_silent(now):
            self._outbox.clear()
            return
        self._do_babble(now)
        frames, late = list(self._outbox), self._late
        self._outbox.clear()
        for frame in frames:
            if late and _is_tpdo(frame):
                # the delayed frame comes before the one that is on time
                self._outbox += late
                late.clear()
            self._filter_frame(frame)
        self._update_active()

    def _filter_frame(self, frame: bytes) -> None:
        identifier = int.from_bytes(frame[:4], "little")
        if self._muted and identifier & _FUNCTION == _ERROR_CONTROL:
            return
        if identifier & _FUNCTION == _SDO_ANSWER and self._answers_left:
            self._answers_left -= 1
            if not self._answers_left:
                self.apply(FAULTS[SILENCE], self._silence_ms)
        elif _is_tpdo(frame):
            if self._consume(_LOST) or (self._loss and self._chance.random() < self._loss):
                return
            if self._consume(_CORRUPTED):
                frame = self._with_wrong_bit(frame)
            if self._consume(_LATE):
                self._late.append(frame)
                return
            if self._consume(_DOUBLED):
                self._outbox.append(frame)
        self._outbox.append(frame)
        if self._twin and identifier & _FUNCTION == _ERROR_CONTROL:
            state = bytes([NmtState.PRE_OPERATIONAL])
            self._outbox.append(pack_frame(_ERROR_CONTROL + self.slave.node_id, state))
        elif self._twin and identifier & _FUNCTION == _SDO_ANSWER:
            self._outbox.append(frame)

    def _with_wrong_bit(self, frame: bytes) -> bytes:
        length = min(frame[4], _LONGEST_FRAME)
        if not length:
            return frame
        bit = self._chance.randrange(8 * length)
        data = bytearray(frame)
        data[_DATA_AT + bit // 8] ^= 1 << bit % 8
        return bytes(data)

    def _consume(self, name: str) -> bool:
        if not self.counts[name]:
            return False
        self.counts[name] -= 1
        if not self.counts[name]:
            self.noted(FAULTS[name], 0)
        return True

    def _do_babble(self, now: float) -> None:
        ms = int(now * 1e3)
        if self._babble and ms != self._last_babble_ms:
            self._last_babble_ms = ms
            self._outbox += [pack_frame(_EMCY + self.slave.node_id, _BABBLE_FRAME)] * self._babble

    def _update_active(self) -> None:
        self.active = bool(
            any(self.counts.values())
            or self._answers_left
            or self._late
            or self._muted
            or self._babble
            or self._twin
            or self._loss
            or self.is_silent(self.slave.now)
        )

    # -- object 2F00h

    def _writer(self, fault: Fault) -> Callable[[Any], None]:
        def write(value: Any) -> None:
            if value and not self.has(fault.needs):
                raise SdoAbort(Abort.HARDWARE_ERROR)
            self.apply(fault, value)

        return write

    def _reader(self, left: Callable[[FaultInjection], float]) -> Callable[[], Value]:
        return lambda: int(left(self))

    def _vanish_after(self, answers: Value) -> None:
        # the answer to the SDO request itself is not affected
        self._answers_left = int(answers) + 1 if answers else 0
        self._silence_ms = _FOR_GOOD_MS
        self._update_active()

    def _silence_after_the_answer(self, ms: Value) -> None:
        self._silence_ms = int(ms)
        self._answers_left = int(bool(ms))
        self._update_active()

    def _refuse_modes(self, how: Value) -> None:
        self.state_machine.ignore_modes = int(how)

    def _show_mode(self, mode: Value) -> None:
        self.state_machine.displayed_mode = int(mode)
        self.state_machine.update()


def _is_tpdo(frame: bytes) -> bool:
    return int.from_bytes(frame[:4], "little") & _FUNCTION in _DEFAULT_TPDO


_TABLE = (
    # the drive
    Fault("drive-off", "loses its supply: no torque, no communication",
          lambda f, v: f.lose_supply(v)),
    Fault("drive-reboot", "restarts, as by a brown-out; its encoder counts from zero again",
          lambda f, _: f.slave.reset_node(), lasts=False),
    Fault("drive-fault", "reports this fault and switches its power off",
          lambda f, v: f.state_machine.trip(v), 0x7305, 1, 0xFFFF, "code", sub=1, lasts=False),
    Fault("power-lost", "loses the supply of its power stage, as by safe torque off",
          lambda f, v: f.state_machine.lose_power(bool(v))),
    Fault("pre-operational", "goes to this NMT state: it ignores PDOs, and keeps its last torque",
          lambda f, _: f.slave.set_nmt_state(NmtState.PRE_OPERATIONAL), lasts=False),
    Fault("nmt-stop", "goes to the NMT state stopped",
          lambda f, _: f.slave.set_nmt_state(NmtState.STOPPED), lasts=False),
    Fault("commands-ignored", "ignores the controlword", lambda f, v: f.ignore_commands(v)),
    # the motor
    Fault("torque-stuck", "keeps its present torque while its power is on",
          lambda f, v: f.axis.stick_torque(bool(v))),
    Fault("torque-bias", "gives this much more torque than it shows",
          lambda f, v: f.set_motor("torque_bias", v), 0.5, -100.0, 100.0, "Nm"),
    Fault("torque-limit", "gives no more than this torque",
          lambda f, v: f.set_motor("torque_cap", v or math.inf), 0.3, 0.001, 100.0, "Nm"),
    # the encoder
    Fault("encoder-jump", "miscounts once; its index pulse stays",
          lambda f, v: f.axis.jump(v), 500, -(2**31), 2**31 - 1, "counts", sub=11, lasts=False),
    Fault("encoder-frozen", "does not count; after `mend` it continues from there",
          lambda f, v: f.axis.freeze_encoder(bool(v))),
    Fault("encoder-noise", "shows noise of this standard deviation",
          lambda f, v: f.set_motor("noise", v or f.axis.plant.encoder.noise_counts),
          20.0, 0.1, 1e4, "counts"),
    Fault("index-missed", "gives no index pulse", lambda f, v: f.axis.miss_index(bool(v))),
    # the bus
    Fault(SILENCE, "neither receives nor sends; 65535: permanently",
          lambda f, v: f.silence(v), _FOR_GOOD_MS, 1, _FOR_GOOD_MS, "ms", sub=6,
          left=lambda f: f.silence_ms),
    Fault("bus-off", "leaves the bus and reacts as to a lost master", lambda f, v: f.bus_off(v)),
    Fault("bus-lost", "loses the bus together with all drives on it",
          lambda f, v: f.lose_bus(v)),
    Fault(_LOST, "does not send this many TPDOs", lambda f, v: f.count(_LOST, v),
          1, 1, 0xFF, "frames", sub=2, left=lambda f: f.counts[_LOST]),
    Fault("frames-lossy", "does not send this share of its TPDOs, at random",
          lambda f, v: f.lose_share(v), 10.0, 0.1, 100.0, "%"),
    Fault(_DOUBLED, "sends this many TPDOs twice", lambda f, v: f.count(_DOUBLED, v),
          1, 1, 0xFF, "frames", sub=7, left=lambda f: f.counts[_DOUBLED]),
    Fault(_LATE, "delays this many TPDOs until the next one", lambda f, v: f.count(_LATE, v),
          1, 1, 0xFF, "frames", sub=8, left=lambda f: f.counts[_LATE]),
    Fault(_CORRUPTED, "sends this many TPDOs with one wrong bit",
          lambda f, v: f.count(_CORRUPTED, v), 1, 1, 0xFF, "frames",
          left=lambda f: f.counts[_CORRUPTED]),
    Fault("duplicate-node", "shares its node id with another device, which stays pre-operational",
          lambda f, v: f.double(v)),
    Fault("no-heartbeat", "sends no heartbeat", lambda f, v: f.mute(v), sub=5),
    Fault("heartbeat-late", "sends its next heartbeat this much later",
          lambda f, v: f.slave.delay_heartbeat(v * 1e-3), 1000, 1, 60_000, "ms", lasts=False),
    Fault("emcy", "sends an emergency message with this code, without a fault",
          lambda f, v: f.send_emcy(v), 0xFF00, 1, 0xFFFF, "code", lasts=False),
    Fault("emcy-flood", "sends this many emergency messages every millisecond",
          lambda f, v: f.babble(v), 1, 1, 0xFF, "messages", sub=9),
    # the cable
    Fault(CUT, "is cut", lambda f, v: f.axis.cut_cable() if v else f.axis.mend_cable(), sub=12,
          needs="cable", left=lambda f: f.axis.cable_cut),
    Fault(SLIP, "slips by this much through its fastening on the drum",
          lambda f, v: f.axis.slip_cable(v * 1e-3) if v else f.axis.mend_cable(),
          100, 1, 0xFFFF, "mm", sub=13, needs="cable", left=lambda f: f.slipped_mm),
    Fault("caught-cable", "is caught at the drum, which cannot turn",
          lambda f, v: f.axis.jam(bool(v)), needs="cable"),
    Fault(CELL_OFF, "shows a tension that is too high by this much", lambda f, v: f.set_cell_off(v),
          40, -(2**15), 2**15 - 1, "N", sub=14, left=lambda f: round(f.axis.cell_off_N)),
    Fault("cell-broken", "its load cell has a broken wire",
          lambda f, v: f.break_cell(TensionFault.BROKEN_WIRE, v), needs="board"),
    Fault("cell-silent", "its load cell does not answer",
          lambda f, v: f.break_cell(TensionFault.SILENT, v), needs="board"),
    # the platform
    Fault("push-x", "is pushed along x", lambda f, v: f.body.push(0, v),
          50.0, -1e5, 1e5, "N", needs="platform", of_robot=True),
    Fault("push-y", "is pushed along y", lambda f, v: f.body.push(1, v),
          50.0, -1e5, 1e5, "N", needs="platform", of_robot=True),
    Fault("push-z", "is pushed along z", lambda f, v: f.body.push(2, v),
          50.0, -1e5, 1e5, "N", needs="space", of_robot=True),
    Fault("obstacle", "is held where it is, by an obstacle of this stiffness",
          lambda f, v: f.body.block(v * 1e3), 50.0, 0.1, 1e3, "N/mm",
          needs="platform", of_robot=True),
    Fault("payload", "carries this additional mass", lambda f, v: f.body.load(v),
          2.0, 0.001, 1e5, "kg", needs="platform", of_robot=True),
    Fault("put-back", "is carried back to its start", lambda f, _: f.body.put_back(),
          sub=15, needs="platform", of_robot=True, lasts=False),
    # the brake of a motor
    Fault("brake-worn", "does not hold", lambda f, v: f.axis.break_brake("worn" if v else "")),
    Fault("brake-stuck", "is always applied",
          lambda f, v: f.axis.break_brake("stuck" if v else "")),
    # the safety I/O
    Fault("stop-pressed", "an emergency stop button is pressed",
          lambda f, v: f.break_io(SafetyIoFault.PRESSED, v), needs="board", of_robot=True),
    Fault("io-silent", "does not answer", lambda f, v: f.break_io(SafetyIoFault.SILENT, v),
          needs="board", of_robot=True),
    Fault("contactor-welded", "its contactor does not open",
          lambda f, v: f.break_io(SafetyIoFault.CONTACTOR_WELDED, v), needs="board", of_robot=True),
    Fault("feedback-stuck", "the feedback of its contactor does not change",
          lambda f, v: f.break_io(SafetyIoFault.FEEDBACK_STUCK, v), needs="board", of_robot=True),
)  # fmt: skip
FAULTS: Final[Mapping[str, Fault]] = {fault.name: fault for fault in _TABLE}
"""All faults, by name."""

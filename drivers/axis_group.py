"""A group of CiA 402 axes on one bus, exchanged once per cycle as arrays."""

from __future__ import annotations

import math
import select
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cdpr_rt.exchange import AxisCommand, AxisFeedback, BoolArray
from drivers import axis_codec as codec
from drivers.axis_codec import FIELDS, STATE_COLUMNS
from drivers.bus import BusUrl, FrameBuffer, open_port
from drivers.bus.packed import FRAME
from drivers.cia402 import (
    CONTROLWORD_TABLE,
    FAULT_RESET,
    STATE_TABLE,
    TARGETS,
    State,
    mode_name,
    supports,
)
from drivers.errors import BusError, DriveFaultError, ModeRefusedError, SdoError
from drivers.network import CanNetwork
from profiles import DriveProfile, Pdo

_SYNC_ID, _HEARTBEAT_ID = 0x080, 0x700
_OPERATIONAL_STATE = 5
_LOCKSTEP_PATIENCE_S = 2.0
_PACED_SHARE = 0.6
_SPARE_FRAMES = 64
_FIELD_OF = {
    0x6041: codec.STATUSWORD,
    0x6064: codec.POSITION,
    0x6077: codec.TORQUE,
    0x6061: codec.MODE_DISPLAY,
    0x60B9: codec.PROBE_STATUS,
    0x60BA: codec.PROBE_POSITION,
}
_ARM_ZERO_PULSE = 0x15  # CiA 402-2, 60B8h: enable, zero pulse, positive edge
_CLOSE_TIMEOUT_S = 1.0


@dataclass(frozen=True)
class AxisConfig:
    """One axis of a group, as its boot found it."""

    node_id: int
    drive: DriveProfile
    rated_torque_Nm: float
    counts_per_turn: int
    supported_modes: int
    torque_limit_Nm: float


class AxisGroup:
    """n axes on one bus; implements `cdpr_rt.exchange.AxisDevice`.

    Nothing is enabled that was not asked for with `request`; a fault takes the request away.
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
    ) -> None:
        self.axes = tuple(axes)
        self.n = len(self.axes)
        self.period_s = period_s
        self.network = network
        self.feedback = AxisFeedback(self.n)
        self.command = AxisCommand(self.n)
        self.missed = 0
        """Cycles in which an axis did not answer in time."""
        self._lay_out_frames(master_node_id)
        filters = [(int(i), 0x7FF) for i in np.flatnonzero(self._slots >= 0)]
        self._port = open_port(url, filters)
        self.lockstep = self._port.status.get("mode") == "lockstep"
        self._port.settimeout(_LOCKSTEP_PATIENCE_S if self.lockstep else 0.0)
        self._heartbeat_cycles = max(1, round(heartbeat_s / period_s))
        self._state = np.zeros((self.n, STATE_COLUMNS), np.int64)
        self._state[:, codec.TARGET] = State.SWITCH_ON_DISABLED
        self._state[:, codec.STATE] = State.UNKNOWN
        self._alarms = np.zeros(self.n, np.int64)
        self._alarmed = False
        self._residual = np.zeros(self.n)
        self._silence = ""
        self._received = 0
        for i, axis in enumerate(self.axes):
            shown = network.read_int(axis.node_id, 0x6061)
            self._state[i, [codec.MODE_WANTED, codec.MODE_SHOWN]] = shown

    def _lay_out_frames(self, master_node_id: int) -> None:
        n = self.n
        self._rx = FrameBuffer(4 * n + _SPARE_FRAMES)
        self._rx_bytes = self._rx.array.view(np.uint8).reshape(-1, 16)
        self._tx = FrameBuffer(n)
        self._tx_bytes = self._tx.array.view(np.uint8).reshape(-1, 16)
        self._sync_frame = FRAME.pack(_SYNC_ID, 0, bytes(8))
        self._heartbeat_frame = FRAME.pack(
            _HEARTBEAT_ID + master_node_id, 1, bytes([_OPERATIONAL_STATE]) + bytes(7)
        )
        self._slots = np.full(2048, -1, np.int64)
        self._rx_layout = np.zeros((n, FIELDS, 3), np.int64)
        self._tx_layout = np.zeros((n, 2), np.int64)
        self._scale = np.zeros((n, 2))
        self._limit = np.array([axis.torque_limit_Nm for axis in self.axes])
        for i, axis in enumerate(self.axes):
            drive = axis.drive
            self._scale[i] = (
                drive.position_sign * math.tau / axis.counts_per_turn,
                drive.torque_sign * axis.rated_torque_Nm / 1000.0,
            )
            for number, pdo in enumerate(drive.tpdos):
                self._slots[pdo.cob_id(axis.node_id)] = 4 * i + number
                for index, start, size in _places(pdo):
                    if index in _FIELD_OF:
                        self._rx_layout[i, _FIELD_OF[index]] = number, start, size
            self._tx.array[i]["can_id"], self._tx.array[i]["length"] = self._lay_out_command(i)

    def _lay_out_command(self, i: int) -> tuple[int, int]:
        axis = self.axes[i]
        for pdo in axis.drive.rpdos:
            places = {index: (start, size) for index, start, size in _places(pdo)}
            if places.keys() >= {0x6040, 0x6071}:
                self._tx_layout[i] = places[0x6040][0], places[0x6071][0]
                return pdo.cob_id(axis.node_id), sum(size for _, size in places.values())
        raise DriveFaultError(
            f"drive profile {axis.drive.name!r}: no RPDO holds both 6040h and 6071h, "
            "which torque control needs"
        )

    # -- the cycle

    def sync(self) -> None:
        """Send the SYNC that opens the cycle."""
        feedback = self.feedback
        feedback.cycle += 1
        feedback.time_s = feedback.cycle * self.period_s
        feedback.valid[:] = False
        self.network.cycling = True
        if self._silence:
            self._port.drain()
            self._silence = ""
        try:
            self._port.send(self._sync_frame)
        except OSError as error:
            raise self._port.lost(error) from error

    def receive(self) -> int:
        """Wait for the answers of this SYNC, decode them; return how many axes answered."""
        rows, port = self._rx.rows, self._port
        deadline = time.monotonic() + _PACED_SHARE * self.period_s
        missing, first, last = self.n, 0, 0
        try:
            while missing and last < len(rows):
                for _ in range(min(missing, len(rows) - last)):
                    if not port.recv_into(rows[last]):
                        raise port.lost()
                    last += 1
                missing -= self._decode(first, last)
                first = last
        except BlockingIOError:
            missing -= self._decode(first, last)
            if not self.lockstep:
                missing -= self._receive_until(deadline, last, missing)
        except OSError as error:
            raise port.lost(error) from error
        if missing:
            self.missed += 1
            self._silence = "late answers may still come"
            if self.lockstep:
                silent = [
                    a.node_id
                    for a, ok in zip(self.axes, self.feedback.valid, strict=True)
                    if not ok
                ]
                self._silence = f"node {silent[0]} does not answer SYNC any more"
        return self.n - missing

    def _receive_until(self, deadline: float, last: int, missing: int) -> int:
        """Wait for the missing answers of a paced cycle until `deadline`; return how many came."""
        rows, port = self._rx.rows, self._port
        answered = 0
        while answered < missing and last < len(rows):
            left = deadline - time.monotonic()
            if left <= 0.0 or not select.select([port], [], [], left)[0]:
                break
            try:
                if not port.recv_into(rows[last]):
                    raise port.lost()
            except BlockingIOError:
                continue
            answered += self._decode(last, last + 1)
            last += 1
        return answered

    def _decode(self, first: int, last: int) -> int:
        feedback = self.feedback
        return codec.decode(
            self._rx_bytes,
            first,
            last,
            self._slots,
            self._rx_layout,
            self._scale,
            STATE_TABLE,
            self._state,
            feedback.statusword,
            feedback.position_rad,
            feedback.torque_Nm,
            feedback.index_rad,
            feedback.index_known,
            feedback.valid,
            self._alarms,
        )

    def transmit(self) -> None:
        """Send controlwords and torques, to act from the next SYNC on."""
        command = self.command
        self._alarmed = codec.encode(
            self._tx_bytes,
            self._tx_layout,
            CONTROLWORD_TABLE,
            self._state,
            self._scale,
            self._limit,
            self._residual,
            command.torque_Nm,
            command.sent_torque_Nm,
            self._alarms,
        )
        try:
            for row in self._tx.rows:
                self._port.send(row)
            if self.feedback.cycle % self._heartbeat_cycles == 0:
                self._port.send(self._heartbeat_frame)
        except OSError as error:
            raise self._port.lost(error) from error

    def alarm(self) -> str:
        """Return why the drives must not go on being driven, or an empty text."""
        if self.network.alarm_text:
            return self.network.alarm_text
        if self._alarmed:
            return self._alarm_text()
        return self._silence if self.lockstep else ""

    def _alarm_text(self) -> str:
        i = int(np.flatnonzero(self._alarms)[0])
        code, node = int(self._alarms[i]), self.axes[i].node_id
        if code == codec.ALARM_FAULT:
            return f"node {node}: the drive is in fault"
        if code == codec.ALARM_LEFT_ENABLED:
            state = State(int(self._state[i, codec.STATE]))
            return f"node {node}: the drive left operation enabled by itself: {state.label}"
        if code == codec.ALARM_MODE:
            wanted, shown = self._state[i, [codec.MODE_WANTED, codec.MODE_SHOWN]]
            return (
                f"node {node}: the drive reports mode {mode_name(int(shown))} "
                f"where {mode_name(int(wanted))} was confirmed before"
            )
        return f"node {node}: a torque that is not a finite number was asked for"

    # -- between cycles

    def stop_cycling(self) -> None:
        """Tell that no cycles run for a while; the master's heartbeat goes on without them."""
        self.network.cycling = False

    def request(self, state: State) -> None:
        """Ask all axes for a state; the cycles lead them there step by step.

        Raises ValueError for a state that cannot be asked for.
        """
        if state not in TARGETS:
            raise ValueError(f"{state.label} cannot be asked for")
        self._state[:, codec.TARGET] = state

    def reached(self, state: State) -> bool:
        """Return whether all axes report `state`."""
        return bool(np.all(self._state[:, codec.STATE] == state))

    def states(self) -> list[State]:
        """Return the state each axis reported last."""
        return [State(int(s)) for s in self._state[:, codec.STATE]]

    def faulted(self) -> BoolArray:
        """Return which axes have been in fault since the last acknowledgement, (n,)."""
        return np.asarray(self._state[:, codec.FAULTED] != 0)

    def acknowledge(self) -> None:
        """Forget latched alarms and send the drives a fault reset with the next cycles.

        The rising edge of bit 7 needs a cycle without it first and one with it; call
        `end_acknowledge` once the drives have left the fault. Nothing is enabled by this.
        """
        self._state[:, codec.TARGET] = State.SWITCH_ON_DISABLED
        self._state[:, codec.FAULTED] = 0
        self._state[:, codec.EXTRA_WORD] = FAULT_RESET
        self.clear_alarms()

    def end_acknowledge(self) -> None:
        """Take the fault-reset bit away and forget the alarms that were raised meanwhile."""
        self._state[:, codec.EXTRA_WORD] = 0
        self._state[:, codec.FAULTED] = 0
        self.clear_alarms()

    def clear_alarms(self) -> None:
        """Forget latched alarms."""
        self._alarms[:] = 0
        self._alarmed = False
        self._silence = ""
        self.network.clear_alarm()

    def set_extra_bits(self, axis: int, bits: int) -> None:
        """Add mode-specific bits to an axis' controlword (start of homing, halt)."""
        self._state[axis, codec.EXTRA_WORD] = bits

    def ask_mode(self, mode: int) -> None:
        """Ask all axes for a mode of operation; `mode_confirmed` tells when they have it.

        Raises ModeRefusedError when an axis is enabled or refuses, with the drive's reason.
        """
        for i, axis in enumerate(self.axes):
            if self._state[i, codec.STATE] == State.OPERATION_ENABLED:
                raise ModeRefusedError(
                    f"node {axis.node_id}: the mode is not changed while the drive is enabled"
                )
            if not supports(axis.supported_modes, mode):
                raise ModeRefusedError(
                    f"node {axis.node_id}: mode {mode_name(mode)} is not among the modes "
                    f"the drive supports (6502h = {axis.supported_modes:08X}h)"
                )
            try:
                self.network.write(axis.node_id, 0x6060, 0, mode)
            except SdoError as error:
                raise ModeRefusedError(
                    f"node {axis.node_id}: mode {mode_name(mode)} was refused: {error}"
                ) from error
            self._state[i, codec.MODE_WANTED] = mode

    def mode_confirmed(self) -> bool:
        """Return whether every axis reports the mode it was asked for (6061h)."""
        return bool(np.all(self._state[:, codec.MODE_SHOWN] == self._state[:, codec.MODE_WANTED]))

    def unconfirmed_mode(self) -> ModeRefusedError:
        """Return the error that names the first axis whose mode is not what was asked for."""
        i = int(
            np.flatnonzero(self._state[:, codec.MODE_SHOWN] != self._state[:, codec.MODE_WANTED])[0]
        )
        wanted, shown = self._state[i, [codec.MODE_WANTED, codec.MODE_SHOWN]]
        return ModeRefusedError(
            f"node {self.axes[i].node_id}: asked for mode {mode_name(int(wanted))}, "
            f"but the drive reports {mode_name(int(shown))} (6061h); it was not enabled"
        )

    def set_index(self, axis: int, position_rad: float) -> None:
        """Note where the encoder index of an axis lies, on the scale of its feedback."""
        self.feedback.index_rad[axis] = position_rad
        self.feedback.index_known[axis] = True

    def arm_touch_probe(self, axis: int) -> None:
        """Have the drive latch the next index pulse during ordinary motion (60B8h)."""
        node = self.axes[axis].node_id
        self.feedback.index_known[axis] = False
        self.network.write(node, 0x60B8, 0, 0)
        self.network.write(node, 0x60B8, 0, _ARM_ZERO_PULSE)
        self._state[axis, codec.PROBE_ARMED] = 1

    # -- the end

    def close(self) -> None:
        """Take torque and power from the drives and leave the bus; best effort on a lost one."""
        try:
            self._disable()
        except BusError:
            pass  # the drives see the master's heartbeat end and stop by themselves
        finally:
            self._port.close()
            self.network.cycling = False

    def _disable(self) -> None:
        self.command.torque_Nm[:] = 0.0
        self._state[:, codec.EXTRA_WORD] = 0
        self.request(State.SWITCH_ON_DISABLED)
        until = time.monotonic() + _CLOSE_TIMEOUT_S
        off = (State.SWITCH_ON_DISABLED, State.NOT_READY, State.FAULT)
        while time.monotonic() < until:
            self.sync()
            answered = self.receive()
            self.transmit()
            if answered == self.n and all(state in off for state in self.states()):
                return
            if not self.lockstep:
                time.sleep(self.period_s)
        self._disable_by_sdo()

    def _disable_by_sdo(self) -> None:
        for axis in self.axes:
            try:
                self.network.write(axis.node_id, 0x6040, 0, 0)
            except SdoError:
                continue  # a node that is gone cannot be told; the others still must be


def _places(pdo: Pdo) -> list[tuple[int, int, int]]:
    """Return (object index, first byte, bytes) of what a PDO maps."""
    places, start = [], 0
    for entry in pdo.entries:
        places.append((entry.index, start, entry.bits // 8))
        start += entry.bits // 8
    return places

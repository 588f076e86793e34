"""LSS slave of CiA 305: node id and bit timing set over the bus, fastscan."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from cdpr_sim_bus.canopen import slave as cob_ids
from cdpr_sim_bus.canopen.abort import SdoAbort
from cdpr_sim_bus.frame import pack_frame

if TYPE_CHECKING:
    from cdpr_sim_bus.canopen.node import CanopenSlave

UNCONFIGURED = 255
"""Node id of a node without one."""

BIT_RATES = {
    0: 1_000_000,
    1: 800_000,
    2: 500_000,
    3: 250_000,
    4: 125_000,
    6: 50_000,
    7: 20_000,
    8: 10_000,
}
"""Bit rate (bit/s) by table index of CiA 305, table 0."""

_IDENTIFIED = b"\x4f"
_OUT_OF_RANGE = 1
_STORE_FAILED = 2


class LssSlave:
    """One LSS slave; the LSS address is 1018h. It listens in every NMT state."""

    def __init__(self, slave: CanopenSlave, *, hides_others: bool = False) -> None:
        """Build the slave.

        With `hides_others` it answers every fastscan in the configuration state, as devices with
        the CANopenNode stack do.
        """
        self._slave = slave
        self._hides_others = hides_others
        self._configuration = False
        self.pending_node_id = slave.node_id
        """Node id that takes effect at the next communication reset."""
        self._pending_bitrate = slave.bitrate
        self._selection: dict[int, int] = {}
        self._scan_position = 0
        self._unmute_timer = slave.timers.add(self._unmute)
        self._commands: dict[int, Callable[[bytes], None]] = {
            0x04: self._switch_global,
            0x11: self._configure_node_id,
            0x13: self._configure_bit_timing,
            0x15: self._activate_bit_timing,
            0x17: self._store,
            0x40: self._select,
            0x41: self._select,
            0x42: self._select,
            0x43: self._select,
            0x4C: self._identify_unconfigured,
            0x51: self._fastscan,
            0x5A: self._inquire,
            0x5B: self._inquire,
            0x5C: self._inquire,
            0x5D: self._inquire,
            0x5E: self._inquire_node_id,
        }
        for command in range(0x46, 0x4C):
            self._commands[command] = self._identify

    def receive(self, frame: bytes, _now: float) -> None:
        """Process a frame of the LSS master; unknown commands are ignored."""
        command = self._commands.get(frame[8])
        if frame[4] == 8 and command is not None:
            command(frame[8:16])

    def _send(self, data: bytes) -> None:
        self._slave.outbox.append(pack_frame(cob_ids.LSS_SLAVE, data.ljust(8, b"\x00")))

    def _address(self, part: int) -> int:
        return self._slave.od.get_int(0x1018, part + 1, 0)

    def _switch_global(self, data: bytes) -> None:
        if data[1] == 1:
            self._configuration = True
        elif data[1] == 0 and self._configuration:
            self._configuration = False
            if self._slave.node_id == UNCONFIGURED and self.pending_node_id != UNCONFIGURED:
                self._slave.reset_communication()

    def _select(self, data: bytes) -> None:
        if self._configuration:
            return
        self._selection[data[0]] = int.from_bytes(data[1:5], "little")
        if data[0] == 0x43:
            if self._selection == {0x40 + part: self._address(part) for part in range(4)}:
                self._configuration = True
                self._send(b"\x44")
            self._selection = {}

    def _identify(self, data: bytes) -> None:
        self._selection[data[0]] = int.from_bytes(data[1:5], "little")
        if data[0] == 0x4B:
            asked = [self._selection.get(command, -1) for command in range(0x46, 0x4C)]
            vendor, product, revision, serial = (self._address(part) for part in range(4))
            if (
                asked[:2] == [vendor, product]
                and asked[2] <= revision <= asked[3]
                and 0 <= asked[4] <= serial <= asked[5]
            ):
                self._send(_IDENTIFIED)
            self._selection = {}

    def _identify_unconfigured(self, _data: bytes) -> None:
        if self._is_unconfigured():
            self._send(b"\x50")

    def _is_unconfigured(self) -> bool:
        return self._slave.node_id == UNCONFIGURED and self.pending_node_id == UNCONFIGURED

    def _fastscan(self, data: bytes) -> None:
        if self._configuration and self._hides_others:
            self._send(_IDENTIFIED)
        if self._configuration or not self._is_unconfigured():
            return
        number, bit, part, following = int.from_bytes(data[1:5], "little"), *data[5:8]
        if bit == 128:
            self._scan_position = 0
            self._send(_IDENTIFIED)
        elif bit < 32 and part < 4 and part == self._scan_position:
            if (number ^ self._address(part)) >> bit:
                return
            if bit == 0:
                self._scan_position = following
                self._configuration = following < part
            self._send(_IDENTIFIED)

    def _configure_node_id(self, data: bytes) -> None:
        if not self._configuration:
            return
        valid = 1 <= data[1] <= 127 or data[1] == UNCONFIGURED
        if valid:
            self.pending_node_id = data[1]
        self._send(bytes([0x11, 0 if valid else _OUT_OF_RANGE]))

    def _configure_bit_timing(self, data: bytes) -> None:
        if not self._configuration:
            return
        bitrate = BIT_RATES.get(data[2]) if data[1] == 0 else None
        valid = bitrate is not None and bitrate in self._slave.od.bitrates
        if bitrate is not None and valid:
            self._pending_bitrate = bitrate
        self._send(bytes([0x13, 0 if valid else _OUT_OF_RANGE]))

    def _activate_bit_timing(self, data: bytes) -> None:
        """Stay silent for two switch delays, then use the new rate, even if the bus has another."""
        if self._configuration:
            delay_s = int.from_bytes(data[1:3], "little") * 1e-3
            self._slave.muted = True
            self._slave.rebuild_handlers()
            self._unmute_timer.arm(self._slave.now + 2 * delay_s)

    def _unmute(self, _now: float) -> None:
        self._slave.bitrate = self._pending_bitrate
        self._slave.muted = self._slave.bitrate != self._slave.bus_bitrate
        self._slave.rebuild_handlers()

    def _store(self, _data: bytes) -> None:
        if not self._configuration:
            return
        store = self._slave.store
        store.node_id, store.bitrate = self.pending_node_id, self._pending_bitrate
        try:
            store.write()
        except SdoAbort:
            self._send(bytes([0x17, _STORE_FAILED]))
        else:
            self._send(b"\x17")

    def _inquire(self, data: bytes) -> None:
        if self._configuration:
            number = self._address(data[0] - 0x5A)
            self._send(data[:1] + number.to_bytes(4, "little"))

    def _inquire_node_id(self, _data: bytes) -> None:
        if self._configuration:
            self._send(bytes([0x5E, self._slave.node_id]))

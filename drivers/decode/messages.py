"""Messages of CiA 301 and CiA 305 that need no knowledge of the device: frame to words."""

from __future__ import annotations

import datetime
import struct
from collections.abc import Callable

from cdpr_drivers.canopen.emergency import register_text
from cdpr_drivers.cia402 import fault_text

Reading = tuple[str, bool]
"""A message in words, and whether it is a problem."""

NMT_STATES = {0: "boot-up", 4: "stopped", 5: "operational", 127: "pre-operational"}
_NMT_COMMANDS = {
    1: "start",
    2: "stop",
    128: "enter pre-operational",
    129: "reset node",
    130: "reset communication",
}
_EMCY = struct.Struct("<HB5s")
_TIME = struct.Struct("<IH")
_CIA_EPOCH = datetime.datetime(1984, 1, 1)


def nmt_command(data: bytes) -> Reading:
    """Read an NMT command."""
    if len(data) != 2:
        return _wrong_length("NMT command", data, 2)
    nodes = f"node {data[1]}" if data[1] else "all nodes"
    command = _NMT_COMMANDS.get(data[0], f"command {data[0]}, which there is not")
    return f"{command}: {nodes}", False


def heartbeat(data: bytes) -> Reading:
    """Read a heartbeat or boot-up message."""
    if len(data) != 1:
        return _wrong_length("heartbeat", data, 1)
    state = data[0] & 0x7F
    return NMT_STATES.get(state, f"NMT state {state}, which there is not"), state not in NMT_STATES


def emergency(data: bytes) -> Reading:
    """Read an EMCY message: a problem where it reports an error, and not its end."""
    if len(data) != 8:
        return _wrong_length("EMCY", data, 8)
    code, register, vendor = _EMCY.unpack(data)
    text = f"{fault_text(code)}; error register {register:02X}h ({register_text(register)})"
    if any(vendor):
        text += f"; manufacturer {vendor.hex(' ').upper()}"
    return text, bool(code >> 8)


def sync(data: bytes) -> Reading:
    """Read a SYNC: its counter, where it has one."""
    if len(data) > 1:
        return _wrong_length("SYNC", data, 1)
    return f"counter {data[0]}" if data else "", False


def time_stamp(data: bytes) -> Reading:
    """Read a TIME message: date and time."""
    if len(data) != 6:
        return _wrong_length("TIME", data, 6)
    milliseconds, days = _TIME.unpack(data)
    moment = _CIA_EPOCH + datetime.timedelta(days=days, milliseconds=milliseconds & 0x0FFFFFFF)
    return moment.isoformat(sep=" ", timespec="milliseconds"), False


_LSS_TABLE_kbit_s = {0: 1000, 1: 800, 2: 500, 3: 250, 4: 125, 6: 50, 7: 20, 8: 10, 9: 0}
_LSS_IDENTITY = ("vendor", "product", "revision", "serial")
_LSS_SELECT = {0x40 + i: f"select by {name}" for i, name in enumerate(_LSS_IDENTITY)}
_LSS_RANGES = (
    "vendor",
    "product",
    "lowest revision",
    "highest revision",
    "lowest serial",
    "highest serial",
)
_LSS_IDENTIFY = {0x46 + i: f"who has {name}" for i, name in enumerate(_LSS_RANGES)}
_LSS_INQUIRE = {0x5A + i: name for i, name in enumerate(_LSS_IDENTITY)} | {0x5E: "node id"}
_LSS_ANSWERS = {
    0x44: "selected",
    0x4F: "a device of this identity is here",
    0x50: "a device without a node id is here",
}
_LSS_CONFIGURED = {0x11: "node id", 0x13: "bit rate", 0x17: "storing"}


def lss_request(data: bytes) -> Reading:
    """Read what an LSS master asks (CiA 305)."""
    if len(data) != 8:
        return _wrong_length("LSS request", data, 8, "-> ")
    command, number = data[0], int.from_bytes(data[1:5], "little")
    text = f"command {command:02X}h, which there is not"
    if command in _LSS_SELECT:
        text = f"{_LSS_SELECT[command]} {number:08X}h"
    elif command in _LSS_IDENTIFY:
        text = f"{_LSS_IDENTIFY[command]} {number:08X}h?"
    elif command in _LSS_INQUIRE:
        text = f"tell your {_LSS_INQUIRE[command]}"
    elif command in _LSS_COMMANDS:
        text = _LSS_COMMANDS[command](data)
    return f"-> {text}", False


def lss_answer(data: bytes) -> Reading:
    """Read what an LSS slave answers."""
    if len(data) != 8:
        return _wrong_length("LSS answer", data, 8, "<- ")
    command, number = data[0], int.from_bytes(data[1:5], "little")
    if command in _LSS_CONFIGURED:
        done = f"refused (error {data[1]}, {data[2]})" if data[1] else "done"
        return f"<- {_LSS_CONFIGURED[command]}: {done}", bool(data[1])
    if command in _LSS_INQUIRE:
        value = str(data[1]) if command == 0x5E else f"{number:08X}h"
        return f"<- {_LSS_INQUIRE[command]} is {value}", False
    text = _LSS_ANSWERS.get(command, f"command {command:02X}h, which there is not")
    return f"<- {text}", command not in _LSS_ANSWERS


def _switch_all(data: bytes) -> str:
    return "all to configuration" if data[1] else "all to waiting (normal operation)"


def _configure_node_id(data: bytes) -> str:
    return f"configure node id {data[1]}" if data[1] != 0xFF else "take the node id away"


def _lss_rate(table: int, index: int) -> str:
    rate = _LSS_TABLE_kbit_s.get(index) if table == 0 else None
    if rate is None:
        return f"number {index} of table {table}"
    return f"{rate} kbit/s" if rate else "found by listening"


def _fastscan(data: bytes) -> str:
    if data[5] == 0x80:
        return "fast scan: start anew"
    number = int.from_bytes(data[1:5], "little")
    part = _LSS_IDENTITY[data[6]] if data[6] < 4 else f"part {data[6]}"
    return f"fast scan: {part} from bit {data[5]} on as in {number:08X}h?"


_LSS_COMMANDS: dict[int, Callable[[bytes], str]] = {
    0x04: _switch_all,
    0x11: _configure_node_id,
    0x13: lambda data: f"configure bit rate {_lss_rate(data[1], data[2])}",
    0x15: lambda data: f"activate the bit rate after {data[1] + 256 * data[2]} ms",
    0x17: lambda _: "store the configuration",
    0x4C: lambda _: "who has no node id?",
    0x51: _fastscan,
}


def _wrong_length(what: str, data: bytes, expected: int, arrow: str = "") -> Reading:
    return f"{arrow}{what} of {len(data)} bytes, not {expected}: {data.hex(' ').upper()}", True

"""Decodes the frames of one bus into readable records."""

from __future__ import annotations

import datetime
import struct
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from cdpr_drivers.bus.health import error_text
from cdpr_drivers.canopen.emergency import Emergency
from cdpr_drivers.canopen.error_control import NMT_STATES, nmt_name
from cdpr_drivers.canopen.lss import BITRATE_INDEX
from cdpr_drivers.decode.candump import Frame
from cdpr_drivers.decode.sdo import SdoDecoder, SdoEvent, Step
from cdpr_drivers.decode.values import DecodedValue, NodeView, ObjectNames, read_field
from cdpr_drivers.drive_units import rated_torque_unit_Nm
from cdpr_drivers.errors import abort_text
from cdpr_profiles import DriveProfile, Pdo, Winch

# PDOs by identifier and their mapping, from profiles and from SDO traffic.

_FIRST_ID, _LAST_ID = 0x180, 0x57F
_NODE, _FUNCTION = 0x07F, 0x780
_OFF = 1 << 31
_MOST_ENTRIES = 64
# CiA 301, predefined connection set
_PREDEFINED = {
    0x180: ("TPDO", 1),
    0x200: ("RPDO", 1),
    0x280: ("TPDO", 2),
    0x300: ("RPDO", 2),
    0x380: ("TPDO", 3),
    0x400: ("RPDO", 3),
    0x480: ("TPDO", 4),
    0x500: ("RPDO", 4),
}
_BASES = {"RPDO": (0x1400, 0x1600), "TPDO": (0x1800, 0x1A00)}


@dataclass
class PdoView:
    """What is known about one PDO of a node."""

    node: NodeView
    kind: str
    """"TPDO" or "RPDO"."""
    number: int
    count: int | None = None
    """Entries in use; None if unknown."""
    entries: dict[int, int] = field(default_factory=dict)
    """Mapping entry (CiA 301: index, sub-index, bits) by position from 1."""

    def read(self, data: bytes) -> tuple[list[DecodedValue], str]:
        """Return the values in a frame, and a note if it does not fit the mapping."""
        values: list[DecodedValue] = []
        start = 0
        for position in range(1, (self.count or 0) + 1):
            entry = self.entries.get(position)
            if entry is None or entry & 7:
                # without its length, the position of the values that follow is unknown
                return values, f"map entry {position} unknown: {_hex(data[start:])}"
            end = start + (entry & 0xFF) // 8
            if end > len(data):
                return values, f"{len(data)} bytes, too few for the map"
            if entry >> 16 >= 0x20:  # lower indices are dummies, which fill gaps
                index, sub = entry >> 16, entry >> 8 & 0xFF
                values.append(read_field(self.node, index, sub, data[start:end]))
            start = end
        if self.count is None and data:
            return values, f"map unknown: {_hex(data)}"
        if start < len(data):
            return values, f"{len(data) - start} bytes more than mapped: {_hex(data[start:])}"
        return values, ""


class PdoTable:
    """The PDOs of all nodes by identifier."""

    def __init__(self) -> None:
        self._by_id: dict[int, PdoView] = {}
        self._by_number: dict[tuple[int, str, int], PdoView] = {}

    def load(self, node: NodeView, kind: str, pdos: Iterable[Pdo]) -> None:
        """Add the PDOs of a node's profile."""
        for pdo in pdos:
            view = self._view(node, kind, pdo.number)
            view.count = len(pdo.entries)
            view.entries = {i: entry.mapping for i, entry in enumerate(pdo.entries, 1)}
            self._by_id[pdo.cob_id(node.node_id)] = view

    def at(self, identifier: int, node: NodeView) -> PdoView | None:
        """Return the PDO with this identifier; if unknown, that of the predefined connection set.

        `node` is the owner of the identifier in that set.
        """
        found = self._by_id.get(identifier)
        if found is None and _FIRST_ID <= identifier <= _LAST_ID and identifier & _NODE:
            kind, number = _PREDEFINED[identifier & _FUNCTION]
            found = self._by_id[identifier] = self._view(node, kind, number)
        return found

    def learn(self, node: NodeView, index: int, sub: int, value: int) -> None:
        """Learn a node's PDO parameters and maps from an SDO transfer."""
        for kind, (parameters, maps) in _BASES.items():
            if parameters <= index < parameters + 0x200 and sub == 1:
                self._move(self._view(node, kind, index - parameters + 1), value)
            elif maps <= index < maps + 0x200:
                view = self._view(node, kind, index - maps + 1)
                if sub == 0:
                    view.count = min(value, _MOST_ENTRIES)
                else:
                    view.entries[sub] = value

    def _view(self, node: NodeView, kind: str, number: int) -> PdoView:
        key = (node.node_id, kind, number)
        if key not in self._by_number:
            self._by_number[key] = PdoView(node, kind, number)
        return self._by_number[key]

    def _move(self, view: PdoView, value: int) -> None:
        """Assign a PDO to the identifier given by its communication parameter."""
        identifier = value & 0x7FF
        if value & _OFF or not identifier:
            return
        for old in [i for i, other in self._by_id.items() if other is view and i != identifier]:
            del self._by_id[old]
        self._by_id[identifier] = view


def _hex(data: bytes) -> str:
    return data.hex(" ").upper() or "no data"


# Messages of CiA 301 and CiA 305 that need no knowledge of the device.

Reading = tuple[str, bool]
"""A message as text, and whether it is a problem."""

_NMT_COMMANDS = {
    1: "start",
    2: "stop",
    128: "enter pre-operational",
    129: "reset node",
    130: "reset communication",
}
_TIME = struct.Struct("<IH")
_CIA_EPOCH = datetime.datetime(1984, 1, 1)


def _nmt_command(data: bytes) -> Reading:
    nodes = f"node {data[1]}" if data[1] else "all nodes"
    command = _NMT_COMMANDS.get(data[0], f"unknown command {data[0]}")
    return f"{command}: {nodes}", False


def _heartbeat(data: bytes) -> Reading:
    state = data[0] & 0x7F
    return nmt_name(state), state not in NMT_STATES


def _emergency(data: bytes) -> Reading:
    message = Emergency.from_frame(0, data, 0.0)
    return message.text, not message.is_reset


def _sync(data: bytes) -> Reading:
    return f"counter {data[0]}" if data else "", False


def _time_stamp(data: bytes) -> Reading:
    milliseconds, days = _TIME.unpack(data)
    moment = _CIA_EPOCH + datetime.timedelta(days=days, milliseconds=milliseconds & 0x0FFFFFFF)
    return moment.isoformat(sep=" ", timespec="milliseconds"), False


_LSS_IDENTITY = ("vendor", "product", "revision", "serial")
_LSS_RANGES = (
    *("vendor", "product", "lowest revision", "highest revision"),
    *("lowest serial", "highest serial"),
)
_LSS_INQUIRE = {0x5A + i: name for i, name in enumerate(_LSS_IDENTITY)} | {0x5E: "node id"}
_LSS_UNKNOWN = "unknown command {command:02X}h"
_LSS_REQUESTS = {
    0x04: "all to {state}",
    0x11: "{node_id}",
    0x13: "configure bit rate {rate}",
    0x15: "activate the bit rate after {delay} ms",
    0x17: "store the configuration",
    **{0x40 + i: f"select by {name} {{number:08X}}h" for i, name in enumerate(_LSS_IDENTITY)},
    **{0x46 + i: f"who has {name} {{number:08X}}h?" for i, name in enumerate(_LSS_RANGES)},
    0x4C: "who has no node id?",
    0x51: "fast scan: {scan}",
    **{command: f"report your {name}" for command, name in _LSS_INQUIRE.items()},
}
_LSS_ANSWERS = {
    0x44: "selected",
    0x4F: "a device of this identity is here",
    0x50: "a device without a node id is here",
}
_LSS_CONFIGURED = {0x11: "node id", 0x13: "bit rate", 0x17: "storing"}
_LSS_RATES = {index: f"{rate // 1000} kbit/s" for rate, index in BITRATE_INDEX.items()}
_LSS_RATES[9] = "found by listening"


def _lss_request(data: bytes) -> Reading:
    """Decode a request of an LSS master (CiA 305)."""
    number = int.from_bytes(data[1:5], "little")
    rate = _LSS_RATES.get(data[2]) if data[1] == 0 else None
    part = _LSS_IDENTITY[data[6]] if data[6] < 4 else f"part {data[6]}"
    text = _LSS_REQUESTS.get(data[0], _LSS_UNKNOWN).format(
        command=data[0],
        number=number,
        state="configuration" if data[1] else "waiting (normal operation)",
        node_id="remove the node id" if data[1] == 0xFF else f"configure node id {data[1]}",
        rate=rate or f"number {data[2]} of table {data[1]}",
        delay=data[1] + 256 * data[2],
        scan="start again"
        if data[5] == 0x80
        else f"who has the bits 31 to {data[5]} of {number:08X}h in its {part}?",
    )
    return f"-> {text}", False


def _lss_answer(data: bytes) -> Reading:
    """Decode an answer of an LSS slave."""
    command = data[0]
    if command in _LSS_CONFIGURED:
        done = f"refused (error {data[1]}, {data[2]})" if data[1] else "done"
        return f"<- {_LSS_CONFIGURED[command]}: {done}", bool(data[1])
    if command in _LSS_INQUIRE:
        number = int.from_bytes(data[1:5], "little")
        value = str(data[1]) if command == 0x5E else f"{number:08X}h"
        return f"<- {_LSS_INQUIRE[command]} is {value}", False
    text = _LSS_ANSWERS.get(command, _LSS_UNKNOWN.format(command=command))
    return f"<- {text}", command not in _LSS_ANSWERS


class _Message(NamedTuple):
    """A kind of message, its allowed lengths, and the function that decodes it."""

    kind: str
    lengths: tuple[int, ...]
    read: Callable[[bytes], Reading]

    def record(self, frame: Frame, node_id: int | None) -> Record:
        data = frame.data
        if len(data) in self.lengths:
            text, problem = self.read(data)
        else:
            text = f"{len(data)} bytes, not {self.lengths[-1]}: {_hex(data)}"
            problem = True
        return Record(frame, self.kind, node_id, text, problem=problem)


_FIXED = {
    0x000: _Message("NMT", (2,), _nmt_command),
    0x080: _Message("SYNC", (0, 1), _sync),
    0x100: _Message("TIME", (6,), _time_stamp),
    0x7E4: _Message("LSS", (8,), _lss_answer),
    0x7E5: _Message("LSS", (8,), _lss_request),
}
_EMCY = _Message("EMCY", (8,), _emergency)
_HEARTBEAT = _Message("heartbeat", (1,), _heartbeat)


_CONFIGURATION = range(0x1400, 0x1C00)


@dataclass(frozen=True)
class Record:
    """One decoded frame."""

    frame: Frame
    kind: str
    """NMT, SYNC, TIME, EMCY, TPDO1, RPDO1, SDO, heartbeat, LSS, error, frame."""
    node_id: int | None
    text: str
    fields: tuple[DecodedValue, ...] = ()
    problem: bool = False
    """Whether the frame reports an error or violates the standard."""

    def line(self, start_s: float) -> str:
        """Return the record as a readable line, with its time counted from `start_s`."""
        node = "" if self.node_id is None else str(self.node_id)
        time = f"{self.frame.time_s - start_s:12.6f}"
        mark = "!" if self.problem else " "
        return (
            f"{time} {mark}{self.frame.id_text:>8} {node:>4}  {self.kind:<10}{self.text}".rstrip()
        )


@dataclass(frozen=True)
class KnownNode:
    """A node as the profiles describe it."""

    drive: DriveProfile
    rated_torque_Nm: float | None = None
    counts_per_turn: int | None = None
    torque_constant_Nm_per_Arms: float = 0.0

    @classmethod
    def of_winch(cls, winch: Winch) -> KnownNode:
        """Return the node that a winch's file describes."""
        motor = winch.motor
        return cls(
            winch.drive,
            motor.rated_torque_Nm,
            winch.encoder_counts_per_turn,
            motor.torque_constant_Nm_per_Arms,
        )


class Decoder:
    """Decodes the frames of one bus in their order.

    `known` are nodes by id; `others`, if given, describes every other node. The decoder also uses
    PDO maps, ratings and modes that it sees in SDO transfers. No frame, whatever its content,
    raises an error.
    """

    def __init__(
        self, known: Mapping[int, KnownNode] | None = None, others: KnownNode | None = None
    ) -> None:
        self._known = dict(known or {})
        self._others = others
        self._nodes: dict[int, NodeView] = {}
        self._sdo_decoders: dict[int, SdoDecoder] = {}
        self._pdos = PdoTable()
        self._names: dict[object, ObjectNames] = {}
        everybody = range(1, 128) if others is not None else sorted(self._known)
        for node_id in everybody:
            self._node(node_id)

    def decode(self, frame: Frame) -> Record:
        """Return what the frame means."""
        if frame.error or frame.extended or frame.remote:
            return self._special(frame)
        fixed = _FIXED.get(frame.can_id)
        if fixed is not None:
            return fixed.record(frame, None)
        node_id = frame.can_id & _NODE
        service = _SERVICES.get(frame.can_id & _FUNCTION) if node_id else None
        if service is not None:
            return service(self, frame, node_id)
        pdo = self._pdos.at(frame.can_id, self._node(node_id))
        if pdo is not None:
            return self._pdo(frame, pdo)
        return Record(frame, "frame", None, f"no CANopen identifier: {_hex(frame.data)}")

    def _node(self, node_id: int) -> NodeView:
        view = self._nodes.get(node_id)
        if view is None:
            known = self._known.get(node_id, self._others if node_id else None)
            eds = known.drive.eds if known is not None else None
            names = self._names.setdefault(eds, ObjectNames(eds))
            view = self._nodes[node_id] = NodeView(node_id, names)
            if known is not None:
                view.drive = known.drive
                view.rated_torque_Nm = known.rated_torque_Nm
                view.counts_per_turn = known.counts_per_turn
                view.torque_constant_Nm_per_Arms = known.torque_constant_Nm_per_Arms
                self._pdos.load(view, "RPDO", known.drive.rpdos)
                self._pdos.load(view, "TPDO", known.drive.tpdos)
        return view

    # -- by kind of message

    def _special(self, frame: Frame) -> Record:
        """Return the meaning of a frame that is not an ordinary data frame."""
        if frame.error:
            return Record(frame, "error", None, error_text(frame.can_id, frame.data), problem=True)
        if frame.extended:
            return Record(frame, "frame", None, f"29-bit identifier: {_hex(frame.data)}")
        node_id = frame.can_id & _NODE
        if frame.can_id & _FUNCTION == 0x700 and node_id:
            return Record(frame, "heartbeat", node_id, "requested (node guarding)")
        return Record(frame, "frame", None, f"remote frame, {frame.length} bytes requested")

    def _heartbeat(self, frame: Frame, node_id: int) -> Record:
        if frame.data[:1] == b"\0":
            self._node(node_id).mode = None
        return _HEARTBEAT.record(frame, node_id)

    def _pdo(self, frame: Frame, pdo: PdoView) -> Record:
        fields, note = pdo.read(frame.data)
        for value in fields:
            self._learn(pdo.node, value.index, value.sub, value.raw)
        texts = [str(value) for value in fields]
        texts += [note] if note else []
        kind = f"{pdo.kind}{pdo.number}"
        problem = bool(note) and pdo.count is not None
        return Record(frame, kind, pdo.node.node_id, "; ".join(texts), tuple(fields), problem)

    def _request(self, frame: Frame, node_id: int) -> Record:
        event = self._sdo_decoder(node_id).request(frame.data)
        return self._sdo_record(frame, node_id, "->", event)

    def _response(self, frame: Frame, node_id: int) -> Record:
        event = self._sdo_decoder(node_id).response(frame.data)
        if event.step in (Step.VALUE, Step.WRITTEN) and event.index is not None and event.data:
            self._learn(self._node(node_id), event.index, event.sub, event.data)
        return self._sdo_record(frame, node_id, "<-", event)

    def _sdo_decoder(self, node_id: int) -> SdoDecoder:
        return self._sdo_decoders.setdefault(node_id, SdoDecoder())

    def _sdo_record(self, frame: Frame, node_id: int, arrow: str, event: SdoEvent) -> Record:
        node = self._node(node_id)
        fields: tuple[DecodedValue, ...] = ()
        if event.data is not None and event.index is not None and event.step in _WITH_VALUE:
            fields = (read_field(node, event.index, event.sub, event.data),)
        text = f"{arrow} {_sdo_text(node, event, fields)}"
        problem = event.step in (Step.ABORT, Step.UNEXPECTED)
        return Record(frame, "SDO", node_id, text, fields, problem)

    def _learn(self, node: NodeView, index: int, sub: int, raw: bytes) -> None:
        number = int.from_bytes(raw, "little")
        if index == 0x6061 and len(raw) == 1:
            node.mode = int.from_bytes(raw, "little", signed=True)
        elif index in _CONFIGURATION and len(raw) <= 4:
            self._pdos.learn(node, index, sub, number)
        elif index == 0x6076 and number and len(raw) == 4:
            unit_Nm = 1e-3 if node.drive is None else rated_torque_unit_Nm(node.drive)
            node.rated_torque_Nm = number * unit_Nm
        elif (index, sub) == (0x608F, 1) and number and len(raw) == 4:
            node.counts_per_turn = number


_WITH_VALUE = (Step.VALUE, Step.ASK_WRITE, Step.WRITTEN)


def _sdo_text(node: NodeView, event: SdoEvent, fields: tuple[DecodedValue, ...]) -> str:
    """Return the action of an SDO frame, as text."""
    what = "" if event.index is None else _object(node, event.index, event.sub)
    value = fields[0].text if fields else ""
    size = "" if event.size is None else f"{event.size} bytes"
    note = f", {event.note}" if event.note else ""
    text_of = {
        Step.ASK_READ: f"read {what}{note}",
        Step.ASK_WRITE: f"write {what} = {value or size or 'a value to follow'}{note}",
        Step.ANNOUNCE: f"{what}: {size or 'a value'} to follow{note}",
        Step.VALUE: f"{what} = {value or 'an incomplete value'}",
        Step.WRITTEN: f"written {what}{f' = {value}' if value else ''}",
        Step.SEGMENT: f"segment of {what}: {size}{note}",
        Step.CONTROL: f"{what}: {event.note}" if what else event.note,
        Step.UNEXPECTED: f"not understood: {event.note}",
    }
    if event.step is Step.ABORT:
        return f"abort {what}: {abort_text(event.code)}"
    return text_of[event.step]


def _object(node: NodeView, index: int, sub: int) -> str:
    name = node.names.name(index, sub)
    number = f"{index:04X}h:{sub}" if sub else f"{index:04X}h"
    return f"{number} {name}" if name else number


_SERVICES: dict[int, Callable[[Decoder, Frame, int], Record]] = {
    0x080: lambda _, frame, node_id: _EMCY.record(frame, node_id),
    0x580: Decoder._response,
    0x600: Decoder._request,
    0x700: Decoder._heartbeat,
}

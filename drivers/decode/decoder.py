"""Decodes the frames of one bus into readable records."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from canopen.sdo.exceptions import SdoAbortedError

from cdpr_drivers.decode import messages
from cdpr_drivers.decode.error_frames import error_text
from cdpr_drivers.decode.frame import Frame
from cdpr_drivers.decode.names import ObjectNames
from cdpr_drivers.decode.pdo import PdoTable, PdoView
from cdpr_drivers.decode.sdo import SdoDecoder, SdoEvent, Step
from cdpr_drivers.decode.values import DecodedValue, NodeView, read_field
from cdpr_profiles import DriveProfile, Winch

_NODE, _FUNCTION = 0x07F, 0x780
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
    """Whether it reports an error or violates the standard."""

    def line(self, start_s: float) -> str:
        """Return the record as a line for people, its time counted from `start_s`."""
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

    @classmethod
    def of_winch(cls, winch: Winch) -> KnownNode:
        """Return the node that a winch's file describes."""
        return cls(winch.drive, winch.motor.rated_torque_Nm, winch.encoder_counts_per_turn)


class Decoder:
    """Decodes the frames of one bus in their order.

    `known` are nodes by id; `others`, where given, describes every other node. PDO
    maps, ratings and modes that SDO transfers show on the way are used from then on. No frame,
    whatever it holds, makes it fail.
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
            kind, read = fixed
            text, problem = read(frame.data)
            return Record(frame, kind, None, text, problem=problem)
        node_id = frame.can_id & _NODE
        service = _SERVICES.get(frame.can_id & _FUNCTION) if node_id else None
        if service is not None:
            return service(self, frame, node_id)
        pdo = self._pdos.at(frame.can_id, self._node(node_id))
        if pdo is not None:
            return self._pdo(frame, pdo)
        return Record(frame, "frame", None, f"no CANopen identifier: {_bytes(frame)}")

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
                self._pdos.load(view, "RPDO", known.drive.rpdos)
                self._pdos.load(view, "TPDO", known.drive.tpdos)
        return view

    # -- by kind of message

    def _special(self, frame: Frame) -> Record:
        """Return what a frame means that is no ordinary data frame."""
        if frame.error:
            return Record(frame, "error", None, error_text(frame.can_id, frame.data), problem=True)
        if frame.extended:
            return Record(frame, "frame", None, f"29-bit identifier: {_bytes(frame)}")
        node_id = frame.can_id & _NODE
        if frame.can_id & _FUNCTION == 0x700 and node_id:
            return Record(frame, "heartbeat", node_id, "asked for (node guarding)")
        return Record(frame, "frame", None, f"remote frame, {frame.length} bytes asked for")

    def _emergency(self, frame: Frame, node_id: int) -> Record:
        text, problem = messages.emergency(frame.data)
        return Record(frame, "EMCY", node_id, text, problem=problem)

    def _heartbeat(self, frame: Frame, node_id: int) -> Record:
        text, problem = messages.heartbeat(frame.data)
        if frame.data[:1] == b"\0":
            self._node(node_id).mode = None
        return Record(frame, "heartbeat", node_id, text, problem=problem)

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
            node.rated_torque_Nm = number * 1e-3
        elif (index, sub) == (0x608F, 1) and number and len(raw) == 4:
            node.counts_per_turn = number


_WITH_VALUE = (Step.VALUE, Step.ASK_WRITE, Step.WRITTEN)


def _sdo_text(node: NodeView, event: SdoEvent, fields: tuple[DecodedValue, ...]) -> str:
    """Return what an SDO frame does, in words."""
    what = "" if event.index is None else _object(node, event.index, event.sub)
    value = fields[0].text if fields else ""
    size = "" if event.size is None else f"{event.size} bytes"
    note = f", {event.note}" if event.note else ""
    text_of = {
        Step.ASK_READ: f"read {what}{note}",
        Step.ASK_WRITE: f"write {what} = {value or size or 'a value to follow'}{note}",
        Step.ANNOUNCE: f"{what}: {size or 'a value'} to follow{note}",
        Step.VALUE: f"{what} = {value or 'a value not seen as a whole'}",
        Step.WRITTEN: f"written {what}{f' = {value}' if value else ''}",
        Step.SEGMENT: f"segment of {what}: {size}{note}",
        Step.CONTROL: f"{what}: {event.note}" if what else event.note,
        Step.UNEXPECTED: f"not understood: {event.note}",
    }
    if event.step is Step.ABORT:
        reason = SdoAbortedError.CODES.get(event.code, "no reason of the standard")
        return f"abort {what}: {reason} ({event.code:08X}h)"
    return text_of[event.step]


def _object(node: NodeView, index: int, sub: int) -> str:
    name = node.names.name(index, sub)
    number = f"{index:04X}h:{sub}" if sub else f"{index:04X}h"
    return f"{number} {name}" if name else number


def _bytes(frame: Frame) -> str:
    return frame.data.hex(" ").upper() or "no data"


_FIXED: dict[int, tuple[str, Callable[[bytes], messages.Reading]]] = {
    0x000: ("NMT", messages.nmt_command),
    0x080: ("SYNC", messages.sync),
    0x100: ("TIME", messages.time_stamp),
    0x7E4: ("LSS", messages.lss_answer),
    0x7E5: ("LSS", messages.lss_request),
}
_SERVICES: dict[int, Callable[[Decoder, Frame, int], Record]] = {
    0x080: Decoder._emergency,
    0x580: Decoder._response,
    0x600: Decoder._request,
    0x700: Decoder._heartbeat,
}

"""Scan of a bus: listen, read objects of all nodes in parallel, and print a table."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from cdpr_drivers.bus import BusUrl
from cdpr_drivers.bus.frames import FRAME
from cdpr_drivers.canopen import sdo
from cdpr_drivers.canopen.emergency import register_text
from cdpr_drivers.canopen.error_control import NMT_STATES, STOPPED
from cdpr_drivers.canopen.network import BusMember
from cdpr_drivers.cia402 import fault_text, mode_name, state_of, supported_modes
from cdpr_drivers.errors import BusError, SdoAbortError, SdoTimeoutError
from cdpr_profiles import DriveProfile, ProfileError, list_profiles, load_drive
from cdpr_profiles.bounded_input import read_toml
from cdpr_rt.core.clock import PacedClock
from cdpr_tools.errors import BadInputError, raised_as

_CIA_402 = 402
_TIMEOUT_S = 0.4
_ATTEMPTS = 2
SETTLE_S = 0.15
"""Time in which a second node may still answer after the first one."""

Object = tuple[int, int]
FIRST: Object = (0x1000, 0)
ALWAYS: tuple[Object, ...] = (
    (0x1018, 1),
    (0x1018, 2),
    (0x1018, 3),
    (0x1018, 4),
    (0x1001, 0),
    (0x1008, 0),
    (0x1017, 0),
)
DRIVE: tuple[Object, ...] = ((0x6502, 0), (0x6041, 0), (0x6061, 0), (0x603F, 0))
_NAMES = {sdo.multiplexer(*what): f"{what[0]:04X}h" for what in (FIRST, *ALWAYS, *DRIVE)}
_NAMES |= {sdo.multiplexer(index, sub): f"{index:04X}h:{sub}" for index, sub in ALWAYS if sub}
_SEGMENT = b""
"""Key of the next segment of a value, in the counts of objects."""


@dataclass
class NodeInfo:
    """Observations about one node id."""

    node_id: int
    nmt_state: int | None = None
    """NMT state in the node's latest heartbeat."""
    heartbeats: int = 0
    answers: bool = False
    """Whether the node answers SDO requests."""
    in_segments: bool = False
    """Whether this scan's last request was for a segment."""
    objects: dict[Object, bytes] = field(default_factory=dict)
    asked: Counter[bytes] = field(default_factory=Counter)
    """Number of requests of each object, by its multiplexer."""
    answered: defaultdict[bytes, list[bytes]] = field(default_factory=lambda: defaultdict(list))
    """The answers to these requests, from any device."""
    is_shared: bool = False
    """Whether another client also makes transfers with the node, so that some answers may be meant
    for that client.
    """

    @property
    def repeated(self) -> set[bytes]:
        """Objects with more answers than requests: several nodes have this id."""
        if self.is_shared:
            return set()
        return {what for what, came in self.answered.items() if len(came) > self.asked[what]}

    @property
    def differing(self) -> list[str]:
        """Repeated objects whose answers differ."""
        objects = self.repeated - {_SEGMENT}
        return sorted(_NAMES[what] for what in objects if len(set(self.answered[what])) > 1)

    def note_answer(self, data: bytes) -> None:
        """Count an SDO answer to a request of this scan."""
        what = data[1:4]
        if data[0] >> 5 == 0:
            what = _SEGMENT
        elif sdo.abort_code(data) is not None:
            came = self.answered.get(what, [])
            if any(one[0] >> 5 == sdo.UPLOAD and sdo.expedited(one) is None for one in came):
                return  # a later segment of a value; its first answer has been counted
        elif data[0] >> 5 != sdo.UPLOAD:
            return
        if self.asked[what]:
            self.answered[what].append(data)

    def number(self, index: int, sub: int = 0) -> int | None:
        """Return an unsigned object; None if it was not received."""
        raw = self.objects.get((index, sub))
        return int.from_bytes(raw, "little") if raw else None

    def text(self, index: int) -> str | None:
        """Return a text object; None if it was not received."""
        raw = self.objects.get((index, 0))
        if raw is None:
            return None
        printed = raw.decode("ascii", "replace").rstrip("\0 ")
        return "".join(c if c.isprintable() else "?" for c in printed)  # no escapes to a terminal

    @property
    def is_drive(self) -> bool:
        """Whether the node's device type (1000h) is that of CiA 402."""
        return (self.number(0x1000) or 0) & 0xFFFF == _CIA_402


LISTEN_S = 1.2
"""Listening time, long enough for heartbeats with a period of 1 s."""
_IN_FLIGHT = 64
_HEARTBEAT = 0x700
_NODE, _FUNCTION = 0x07F, 0x780
_RPDOS = (0x200, 0x300, 0x400, 0x500)
_FILTERS = [(0x000, 0x7FF), (0x080, 0x7FF)]
_FILTERS += [(base, _FUNCTION) for base in (*_RPDOS, sdo.ANSWER, sdo.REQUEST, _HEARTBEAT)]
_LAST_STANDARD_ID = 0x7FF
_NEXT_SEGMENT = 0x60
_MOST_BYTES = 1024
"""Maximum size of an object; the objects that this scan reads are shorter."""


@dataclass
class Traffic:
    """Traffic of other nodes on the bus."""

    sdo_requests: set[int] = field(default_factory=set)
    """Nodes that another SDO client reads or writes."""
    heard: set[str] = field(default_factory=set)
    """SYNC, NMT, RPDO: signs of an active master."""


class Scan(BusMember):
    """A connection to a bus; `listen` sends nothing, `ask` reads and never writes.

    Raises BadInputError for a bus that cannot be opened, BusError if it is lost.
    """

    def __init__(self, url: BusUrl, node_ids: Iterable[int]) -> None:
        self.traffic = Traffic()
        self.found = {node_id: NodeInfo(node_id) for node_id in node_ids}
        self._clients: dict[int, sdo.SdoClient] = {}
        self._loss: BusError | None = None
        with raised_as(BadInputError, BusError):
            super().__init__(url, PacedClock(), _FILTERS)

    def on_loss(self, error: BusError) -> None:
        """End the transfers and the wait."""
        self._loss = error
        for client in self._clients.values():
            client.fail(error)

    def listen(self, seconds: float) -> None:
        """Receive for this time without sending."""
        self.clock.wait(lambda: self._loss, self.clock.now_s + seconds)
        if self._loss is not None:
            raise self._loss

    def ask(self) -> None:
        """Read the objects of all nodes, many in parallel; note repeated answers."""
        waiting = list(self.found.values())
        for start in range(0, len(waiting), _IN_FLIGHT):
            reads = [partial(self._read, found) for found in waiting[start : start + _IN_FLIGHT]]
            for task in self.clock.gather(reads):
                task.result()
        self.listen(SETTLE_S)
        for node_id in self.traffic.sdo_requests & self.found.keys():
            self.found[node_id].is_shared = True

    def _read(self, found: NodeInfo) -> None:
        """Read the objects of one node; skip those that it rejects or does not return."""
        client = sdo.SdoClient(partial(self._request, found), self.clock, _MOST_BYTES)
        self._clients[found.node_id] = client
        self._read_object(client, found, FIRST)
        if found.answers:
            for what in ALWAYS + (DRIVE if found.is_drive else ()):
                self._read_object(client, found, what)

    @staticmethod
    def _read_object(client: sdo.SdoClient, found: NodeInfo, what: Object) -> None:
        for _ in range(_ATTEMPTS):
            try:
                found.objects[what] = client.upload(*what, _TIMEOUT_S)
            except SdoTimeoutError:
                continue
            except SdoAbortError:
                pass  # the node has no such object
            found.answers = True
            return

    def _request(self, found: NodeInfo, data: bytes) -> None:
        if data[0] == sdo.ABORT and not found.in_segments:
            return  # this abort could only end another master's transfer
        found.in_segments = data[0] & 0xEF == _NEXT_SEGMENT
        found.asked[data[1:4] if data[0] == 0x40 else _SEGMENT] += data[0] != sdo.ABORT
        self.send(sdo.REQUEST + found.node_id, data)

    def take_frame(self, frame: memoryview) -> None:
        """Process one frame; ignore it if it is not an 11-bit data frame."""
        identifier, length, data = FRAME.unpack_from(frame)
        if identifier > _LAST_STANDARD_ID:
            return
        node_id, function = identifier & _NODE, identifier & _FUNCTION
        if function == _HEARTBEAT and node_id in self.found and length == 1:
            found = self.found[node_id]
            found.heartbeats += 1
            found.nmt_state = data[0] & 0x7F
        elif function == sdo.ANSWER and length == 8:
            if node_id in self._clients:
                self.found[node_id].note_answer(data)
                self._clients[node_id].on_answer(data)
        elif function == sdo.REQUEST and node_id:
            self.traffic.sdo_requests.add(node_id)
        elif identifier == 0x080:
            self.traffic.heard.add("SYNC")
        elif identifier == 0x000:
            self.traffic.heard.add("NMT commands")
        elif function in _RPDOS and node_id:
            self.traffic.heard.add("RPDOs")

    def __enter__(self) -> Scan:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def drive_profiles(folder: Path | None) -> dict[str, DriveProfile]:
    """Return the shipped drives by name, and those in a folder by path.

    Raises BadInputError if `folder` is not a folder, ProfileError for a broken drive file.
    """
    drives = {name: load_drive(name) for name in list_profiles()["drives"]}
    if folder is None:
        return drives
    if not folder.is_dir():
        raise BadInputError(f"--profiles {folder}: is not a folder")
    for path in sorted(folder.glob("*.toml")):
        if "eds" in read_toml(path):  # motors, winches and cables may be in the same folder
            drives[str(path)] = load_drive(path)
    if not any(Path(name).parent == folder for name in drives):
        raise ProfileError(folder, "", "contains no drive profile")
    return drives


def matching_profiles(found: NodeInfo, drives: dict[str, DriveProfile]) -> list[str]:
    """Return the names of the profiles that match a node; note if the revision differs."""
    names = []
    for name, drive in drives.items():
        identity = (found.number(0x1018, 1), found.number(0x1018, 2))
        if identity != (drive.vendor_id, drive.product_code):
            continue
        if drive.serial is not None and drive.serial != found.number(0x1018, 4):
            continue
        revision = found.number(0x1018, 3)
        same = revision is None or revision == drive.revision
        names.append(name if same else f"{name} (but its revision is {drive.revision:08X}h)")
    return names


_MODES = {1: "PP", 2: "VL", 3: "PV", 4: "PT", 6: "HM", 7: "IP", 8: "CSP", 9: "CSV", 10: "CST"}
_TITLES = ("id", "NMT state", "device", "profile", "CiA 402 state", "modes")


def entry(found: NodeInfo, drives: dict[str, DriveProfile]) -> dict[str, Any]:
    """Return one node as data for programs."""
    status, modes = found.number(0x6041), found.number(0x6502)
    state = found.nmt_state
    return {
        "node_id": found.node_id,
        "nmt_state": None if state is None else NMT_STATES.get(state, str(state)),
        "heartbeats": found.heartbeats,
        "heartbeat_ms": found.number(0x1017),
        "answers_sdo": found.answers,
        "device_type": found.number(0x1000),
        "device_name": found.text(0x1008),
        "vendor_id": found.number(0x1018, 1),
        "product_code": found.number(0x1018, 2),
        "revision": found.number(0x1018, 3),
        "serial": found.number(0x1018, 4),
        "error_register": found.number(0x1001),
        "cia402": found.is_drive,
        "state": None if status is None else state_of(status).label,
        "mode": _mode(found.number(0x6061)),
        "supported_modes": None if modes is None else supported_modes(modes),
        "error": _error(found.number(0x603F)),
        "profiles": matching_profiles(found, drives) if found.is_drive else [],
        "problems": problems(found),
    }


def problems(found: NodeInfo) -> list[str]:
    """Return the problems of a node."""
    texts = []
    if found.repeated:
        texts.append(
            "several nodes have this id: two answers to one request"
            + (f", differing for {', '.join(found.differing)}" if found.differing else "")
        )
    if not found.answers:
        closed = "; a stopped node never answers" if found.nmt_state == STOPPED else ""
        texts.append(f"sends only heartbeats and does not answer SDO (a master?{closed})")
    elif not found.is_drive:
        device = found.number(0x1000)
        if device is None:
            texts.append("does not give its device type (1000h)")
        else:
            profile = device & 0xFFFF
            kind = f"CiA {profile}" if profile else "no device profile, such as a bootloader"
            texts.append(f"not a CiA 402 drive: device type {device:08X}h ({kind})")
    register = found.number(0x1001)
    if register:
        texts.append(f"error register {register:02X}h: {register_text(register)}")
    return texts


def _mode(number: int | None) -> str | None:
    if number is None:
        return None
    return mode_name(number - 256 if number > 127 else number)


def _error(code: int | None) -> str | None:
    return fault_text(code & 0xFFFF) if code else None


def responding(found: dict[int, NodeInfo]) -> list[NodeInfo]:
    """Return the nodes that have sent or answered anything."""
    return [one for one in found.values() if one.answers or one.heartbeats]


def lines(entries: Sequence[dict[str, Any]]) -> list[str]:
    """Return a readable table: a row for each node, below it the node's identity and problems."""
    rows = [_TITLES, *(_row(node) for node in entries)]
    widths = [max(len(row[i]) for row in rows) for i in range(len(_TITLES))]
    table: list[str] = []
    for number, row in enumerate(rows):
        cells = [row[0].rjust(widths[0])]
        cells += [cell.ljust(width) for cell, width in zip(row[1:], widths[1:], strict=True)]
        table.append("  ".join(cells).rstrip())
        if number:
            indent = " " * (widths[0] + 2)
            table += [indent + detail for detail in _details(entries[number - 1])]
    return table


def _row(node: dict[str, Any]) -> tuple[str, ...]:
    modes = node["supported_modes"]
    return (
        str(node["node_id"]),
        node["nmt_state"] or "unknown",
        node["device_name"] or "-",
        ", ".join(node["profiles"]) or "-",
        node["state"] or "-",
        "-" if modes is None else " ".join(_MODES[mode] for mode in modes),
    )


def _details(node: dict[str, Any]) -> list[str]:
    details = []
    names = ("vendor_id", "product_code", "revision", "serial")
    identity = [(name.partition("_")[0], node[name]) for name in names if node[name] is not None]
    if identity:
        details.append(", ".join(f"{name} {value:08X}h" for name, value in identity))
    doing = [f"mode {node['mode']}"] if node["mode"] else []
    doing += [f"error {node['error']}"] if node["error"] else []
    if node["answers_sdo"]:
        period = node["heartbeat_ms"]
        doing.append(f"heartbeat every {period} ms" if period else "no heartbeat")
    if doing:
        details.append("; ".join(doing))
    return details + [f"! {problem}" for problem in node["problems"]]


def signs_of_a_master(traffic: Traffic) -> str:
    """Return the signs of an active master, or ""."""
    signs = sorted(traffic.heard)
    if traffic.sdo_requests:
        nodes = ", ".join(map(str, sorted(traffic.sdo_requests)))
        signs.append(f"SDO requests to node {nodes}")
    return ", ".join(signs)

"""Scan of a bus: listening, reading objects of all nodes at once, and a table of what was found."""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from cdpr_drivers.bus import BusUrl, FramePort, open_port
from cdpr_drivers.canopen.emergency import register_text
from cdpr_drivers.cia402 import fault_text, mode_name, state_of, supported_modes
from cdpr_drivers.decode import Frame
from cdpr_drivers.decode.messages import NMT_STATES
from cdpr_drivers.errors import BusError
from cdpr_profiles import DriveProfile, ProfileError, list_profiles, load_drive
from cdpr_profiles.reading.bounded_input import read_toml
from cdpr_tools.busview.node_reader import SETTLE_S, NodeInfo, NodeReader
from cdpr_tools.errors import BadInputError, raised_as

LISTEN_S = 1.2
"""Long enough for heartbeats of a second."""
_IN_FLIGHT = 64
_POLL_S = 0.005
_FRAME_BYTES, _CONTROL_BYTES = 16, 4096
_REQUEST, _ANSWER, _HEARTBEAT = 0x600, 0x580, 0x700
_NODE, _FUNCTION = 0x07F, 0x780
_RPDOS = (0x200, 0x300, 0x400, 0x500)
_FILTERS = [(0x000, 0x7FF), (0x080, 0x7FF)]
_FILTERS += [(base, _FUNCTION) for base in (*_RPDOS, _ANSWER, _REQUEST, _HEARTBEAT)]
_AT_ONCE = 100


@dataclass
class Traffic:
    """What others say on the bus."""

    sdo_requests: set[int] = field(default_factory=set)
    """Nodes that another SDO client reads or writes."""
    heard: set[str] = field(default_factory=set)
    """SYNC, NMT, RPDO: signs of a master at work."""


class Scan:
    """A visit to a bus; `listen` sends nothing, `ask` reads and never writes.

    Raises BadInputError for a bus that cannot be opened, BusError when it is lost.
    """

    def __init__(self, url: BusUrl, node_ids: Iterable[int]) -> None:
        self.traffic = Traffic()
        self.found = {node_id: NodeInfo(node_id) for node_id in node_ids}
        self._asking: dict[int, NodeReader] = {}
        self._packet = bytearray(_CONTROL_BYTES)
        with raised_as(BadInputError, BusError):
            self._port: FramePort = open_port(url, _FILTERS)
        self._port.settimeout(_POLL_S)

    def listen(self, seconds: float) -> None:
        """Receive for so long without sending."""
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            self._receive()

    def ask(self) -> None:
        """Read the objects of all nodes, many at once, and note who answers one request twice."""
        waiting = [NodeReader(found) for found in self.found.values()]
        waiting.reverse()
        self._asking = {asking.found.node_id: asking for asking in waiting}
        active: list[NodeReader] = []
        while waiting or active:
            while waiting and len(active) < _IN_FLIGHT:
                active.append(waiting.pop())
            now = time.monotonic()
            for asking in active:
                self._send(asking.found.node_id, asking.due(now))
            active = [asking for asking in active if not asking.done]
            for _ in range(_AT_ONCE):
                if not self._receive():
                    break
        self.listen(SETTLE_S)
        for node_id in self.traffic.sdo_requests & self.found.keys():
            # another client may have asked for what came
            self.found[node_id].repeated.clear()
            self.found[node_id].differing.clear()

    def _send(self, node_id: int, data: bytes | None) -> None:
        if data is None:
            return
        try:
            self._port.send(Frame(0.0, _REQUEST + node_id, data).pack())
        except OSError as error:
            raise self._port.lost(error) from error

    def _receive(self) -> bool:
        """Receive and process one frame, or wait a little for it; return whether one came."""
        try:
            length = self._port.recv_into(self._packet)
        except BlockingIOError:
            return False
        except OSError as error:
            raise self._port.lost(error) from error
        if length == 0:
            raise self._port.lost()
        if length == _FRAME_BYTES:
            frame = Frame.unpack(0.0, self._packet[:_FRAME_BYTES])
            if not (frame.error or frame.extended or frame.remote):
                self._take(frame.can_id, frame.data)
        return True

    def _take(self, identifier: int, data: bytes) -> None:
        node_id, function = identifier & _NODE, identifier & _FUNCTION
        if function == _HEARTBEAT and node_id in self.found and len(data) == 1:
            found = self.found[node_id]
            found.heartbeats += 1
            found.nmt_state = data[0] & 0x7F
        elif function == _ANSWER and len(data) == 8:
            asking = self._asking.get(node_id)
            if asking is not None:
                self._send(node_id, asking.take(data, time.monotonic()))
        elif function == _REQUEST and node_id:
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
        self._port.close()


def drive_profiles(folder: Path | None) -> dict[str, DriveProfile]:
    """Return the shipped drives by name, and those in a folder by path.

    Raises BadInputError for a folder that is none, ProfileError for a broken drive file.
    """
    drives = {name: load_drive(name) for name in list_profiles()["drives"]}
    if folder is None:
        return drives
    if not folder.is_dir():
        raise BadInputError(f"--profiles {folder}: is no folder")
    for path in sorted(folder.glob("*.toml")):
        if "eds" in read_toml(path):  # motors, winches and cables may lie beside the drives
            drives[str(path)] = load_drive(path)
    if not any(Path(name).parent == folder for name in drives):
        raise ProfileError(folder, "", "holds no drive profile")
    return drives


def matching_profiles(found: NodeInfo, drives: dict[str, DriveProfile]) -> list[str]:
    """Return the names of the profiles that are for a node, noting where the revision differs."""
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
_STOPPED = 4


def entry(found: NodeInfo, drives: dict[str, DriveProfile]) -> dict[str, Any]:
    """Return one node for programs."""
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
    """Return what is wrong with a node, in words."""
    texts = []
    if found.repeated:
        texts.append(
            "several nodes have this id: two answers to one request"
            + (f", differing for {', '.join(sorted(found.differing))}" if found.differing else "")
        )
    if not found.answers:
        closed = "; a stopped node never does" if found.nmt_state == _STOPPED else ""
        texts.append(f"heartbeats only, it answers no SDO (a master?{closed})")
    elif not found.is_drive:
        device = found.number(0x1000)
        if device is None:
            texts.append("does not give its device type (1000h)")
        else:
            profile = device & 0xFFFF
            kind = f"CiA {profile}" if profile else "no device profile, as a bootloader has"
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
    """Return the nodes that have shown themselves."""
    return [one for one in found.values() if one.answers or one.heartbeats]


def lines(entries: Sequence[dict[str, Any]]) -> list[str]:
    """Return a table for people: a row for each node, below it who it is and what is wrong."""
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
        node["nmt_state"] or "not told",
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
    """Return what tells of a master at work, "" where nothing does."""
    signs = sorted(traffic.heard)
    if traffic.sdo_requests:
        nodes = ", ".join(map(str, sorted(traffic.sdo_requests)))
        signs.append(f"SDO requests to node {nodes}")
    return ", ".join(signs)

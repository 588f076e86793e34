"""What a scan has found, as a table for people and for programs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from cdpr_drivers.canopen.emergency import register_text
from cdpr_drivers.cia402 import fault_text, mode_name, state_of, supported_modes
from cdpr_drivers.decode.messages import NMT_STATES
from cdpr_profiles import DriveProfile
from cdpr_tools.busview.node_reader import NodeInfo
from cdpr_tools.busview.profile_match import matching_profiles
from cdpr_tools.busview.scan import Traffic

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

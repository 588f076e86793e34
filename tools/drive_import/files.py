"""The files that an import leaves: the profile as TOML, and an EDS that every reader reads."""

from __future__ import annotations

import io
import json
from typing import Any

from canopen.objectdictionary import ObjectDictionary, ODVariable
from canopen.objectdictionary.eds import import_eds

from cdpr_profiles.eds.eds_check import EdsFile
from cdpr_profiles.eds.eds_text import MOST_EDS_BYTES
from cdpr_profiles.eds.eds_write import render_eds
from cdpr_profiles.reading.bounded_input import read_bytes
from cdpr_tools.drive_import.proposal import Proposal

_NODE = 1
_NAMES = {
    0x6040: "controlword",
    0x6071: "target torque",
    0x6041: "statusword",
    0x6064: "position actual value",
    0x6077: "torque actual value",
    0x6061: "mode display",
    0x60B9: "touch probe status",
    0x60BA: "touch probe 1, positive edge",
}
_HEXADECIMAL = ("vendor_id", "product_code", "revision", "cob_id_offset", "index")


def eds_text(eds: EdsFile) -> tuple[bytes, bool]:
    """Return the content for the EDS beside the profile, and whether it had to be rewritten.

    It is the file itself where the `canopen` package, which the master uses, understands it as
    we do.
    """
    mended = render_eds(eds)
    original = read_bytes(eds.path, MOST_EDS_BYTES)
    try:
        same = _meaning(original.decode("utf-8")) == _meaning(mended)
    except Exception:  # whatever a flaw of the file makes the package raise
        same = False
    return (original, False) if same else (mended.encode("utf-8"), True)


def _meaning(text: str) -> tuple[Any, ...]:
    od: ObjectDictionary = import_eds(io.StringIO(text), _NODE)  # type: ignore[no-untyped-call]
    entries = {}
    for record in od.values():
        parts = [record] if isinstance(record, ODVariable) else list(record.subindices.values())
        for part in parts:
            entries[part.index, part.subindex] = (
                *(part.data_type, part.access_type, part.pdo_mappable, part.min, part.max),
                *(part.default, part.value, part.relative, part.name),
            )
    return entries, od.device_information.allowed_baudrates, od.bitrate


def profile_text(made: Proposal, eds_name: str, source: str) -> str:
    """Return the profile as TOML with comments."""
    table = made.table
    lines = [
        f"# Made from {_plain(source)} by `cdpr drive import`: see [verified] for what is assumed,",
        "# and docs/describing-your-drive.md for how to find it out.",
        f"name = {_toml(table['name'])}",
        f"eds = {_toml(eds_name)}",
        "",
    ]
    for key, value in table.items():
        if key not in ("name", "rpdos", "tpdos"):
            lines.append(f"{key} = {_toml(value, key)}")
    for key in ("rpdos", "tpdos"):
        for pdo in table[key]:
            lines += ["", f"[[{key}]]", *_pdo_lines(pdo)]
    lines += ["", '# "verified" on the drive, from its "manual" (the EDS is one), or "assumed".']
    lines.append("[verified]")
    for key, (status, how) in made.verified.items():
        lines.append(f"{key} = {{ status = {_toml(status)}, how = {_toml(how)} }}")
    return "\n".join(lines) + "\n"


def _pdo_lines(pdo: dict[str, Any]) -> list[str]:
    keys = [f"{key} = {_toml(value, key)}" for key, value in pdo.items() if key != "entries"]
    entries = []
    for entry in pdo["entries"]:
        inner = ", ".join(f"{key} = {_toml(value, key)}" for key, value in entry.items())
        name = _NAMES.get(entry["index"])
        entries.append(f"  {{ {inner} }}," + (f"  # {name}" if name else ""))
    return [*keys, "entries = [", *entries, "]"]


def _toml(value: Any, key: str = "") -> str:
    if isinstance(value, str):
        return json.dumps(_plain(value), ensure_ascii=False)
    if isinstance(value, list):
        return "[" + ", ".join(_toml(one) for one in value) + "]"
    if isinstance(value, int) and key in _HEXADECIMAL:
        return f"0x{value:X}" if value < 1 << 16 else f"0x{value:08X}"
    return repr(value)


def _plain(text: str) -> str:
    """Return text that may stand in TOML: what cannot be printed is left out."""
    return "".join(c for c in text if c.isprintable())

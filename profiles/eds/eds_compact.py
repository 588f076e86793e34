"""The short forms of an EDS (CiA 306: CompactSubObj, CompactPDO), written out in full."""

from __future__ import annotations

import re

from cdpr_profiles.eds.eds_text import Remarks, Section, integer
from cdpr_profiles.errors import value_text

_INDEX = re.compile(r"[0-9a-f]{4}", re.ASCII)
_MOST_PDOS = 512
_PDO_ENTRIES = 8
_PREDEFINED = 4
_OFF = 0x80000000
_U8, _U16, _U32 = "0x0005", "0x0006", "0x0007"
_COMMUNICATION = {
    1: ("COB-ID", _U32),
    2: ("Transmission type", _U8),
    3: ("Inhibit time", _U16),
    4: ("Compatibility entry", _U8),
    5: ("Event timer", _U16),
    6: ("SYNC start value", _U8),
}


def expand_compact(sections: dict[str, Section], remarks: Remarks) -> None:
    """Add the sections that the short forms of a file stand for."""
    for key in [key for key in sections if _INDEX.fullmatch(key)]:
        if sections[key].get("CompactSubObj"):
            _expand_array(key, sections, remarks)
    _expand_pdos(sections, remarks)


def _expand_array(key: str, sections: dict[str, Section], remarks: Remarks) -> None:
    """Write out an array whose entries are all alike; names and values may be given apart."""
    head = sections[key]
    text = head.get("CompactSubObj")
    count = integer(text)
    if count is None or not 0 <= count <= 254:
        remarks.add(head.place("CompactSubObj"), f"value {value_text(text)}; allowed: 0 to 254")
        return
    if count == 0:
        return
    names, values, given = (
        sections.get(key + part, Section("")) for part in ("name", "value", "parametervalue")
    )
    _add(sections, f"{head.name}sub0", "Number of entries", _U8, "ro", str(count))
    for sub in range(1, count + 1):
        name = names.get(str(sub)) or f"{head.get('ParameterName')}{sub}"
        entry = _add(
            sections,
            f"{head.name}sub{sub:X}",
            name,
            head.get("DataType"),
            head.get("AccessType"),
            values.get(str(sub)) or head.get("DefaultValue"),
        )
        for limit in ("PDOMapping", "LowLimit", "HighLimit"):
            entry.keys.setdefault(limit.lower(), head.get(limit))
        entry.keys.setdefault("parametervalue", given.get(str(sub)))
    head.keys["objecttype"] = head.get("ObjectType") or "0x8"


def _expand_pdos(sections: dict[str, Section], remarks: Remarks) -> None:
    """Write out the PDOs that [DeviceInfo] only counts, with the sub-indices that it names."""
    info = sections.get("deviceinfo", Section("DeviceInfo"))
    text = info.get("CompactPDO")
    present = integer(text) or 0
    if present <= 0:
        return
    for count_key, communication, identifier in (
        ("NrOfRXPDO", 0x1400, 0x200),
        ("NrOfTXPDO", 0x1800, 0x180),
    ):
        count = integer(info.get(count_key)) or 0
        if not 0 <= count <= _MOST_PDOS:
            remarks.add(
                info.place(count_key), f"value {count}; allowed: 0 to {_MOST_PDOS}; left out"
            )
            continue
        for number in range(1, count + 1):
            cob_id = f"$NODEID+{identifier + (number - 1) * 0x100:#x}"
            cob_id = cob_id if number <= _PREDEFINED else hex(_OFF)
            _add_pdo(sections, communication + number - 1, present, cob_id)
        if count:
            remarks.add(
                info.place("CompactPDO"),
                f"{count_key}={count}: not described one by one; taken as PDOs that can be mapped",
            )


def _add_pdo(sections: dict[str, Section], index: int, present: int, cob_id: str) -> None:
    """Add one PDO's communication and mapping parameters where the file has none."""
    subs = [sub for sub in _COMMUNICATION if present >> (sub - 1) & 1]
    if f"{index:04x}" not in sections and subs:
        _add_record(sections, index, "PDO communication parameter", len(subs) + 1)
        _add(sections, f"{index:04X}sub0", "Highest sub-index", _U8, "ro", str(max(subs)))
        defaults = {1: cob_id, 2: "255"}
        for sub in subs:
            name, data_type = _COMMUNICATION[sub]
            default = defaults.get(sub, "0")
            _add(sections, f"{index:04X}sub{sub:X}", name, data_type, "rw", default)
    mapping = index + 0x200
    if f"{mapping:04x}" not in sections:
        _add_record(sections, mapping, "PDO mapping parameter", _PDO_ENTRIES + 1)
        _add(sections, f"{mapping:04X}sub0", "Mapped objects", _U8, "rw", "0")
        for sub in range(1, _PDO_ENTRIES + 1):
            _add(sections, f"{mapping:04X}sub{sub:X}", f"Object {sub}", _U32, "rw", "0")


def _add_record(sections: dict[str, Section], index: int, name: str, count: int) -> None:
    keys = {"parametername": name, "objecttype": "0x9", "subnumber": str(count)}
    sections[f"{index:04x}"] = Section(f"{index:04X}", keys)


def _add(
    sections: dict[str, Section], name: str, title: str, data_type: str, access: str, default: str
) -> Section:
    """Add an entry, unless the file describes it; return the section."""
    keys = {
        "parametername": title,
        "datatype": data_type,
        "accesstype": access,
        "defaultvalue": default,
    }
    return sections.setdefault(name.lower(), Section(name, keys))

"""Writes an EDS or DCF from its objects, in the plainest form of CiA 306."""

from __future__ import annotations

from collections.abc import Iterable

from cdpr_profiles.eds.eds_check import EdsFile, EdsObject
from cdpr_profiles.eds.eds_text import integer
from cdpr_profiles.eds.eds_values import Value

_MANDATORY = (0x1000, 0x1001, 0x1018)
_WORDS = {"vendorname": "VendorName", "productname": "ProductName", "ordercode": "OrderCode"}
_NUMBERS = {
    "vendornumber": "VendorNumber",
    "productnumber": "ProductNumber",
    "revisionnumber": "RevisionNumber",
    "simplebootupmaster": "SimpleBootUpMaster",
    "simplebootupslave": "SimpleBootUpSlave",
    "granularity": "Granularity",
    "dynamicchannelssupported": "DynamicChannelsSupported",
    "groupmessaging": "GroupMessaging",
    "nrofrxpdo": "NrOfRXPDO",
    "nroftxpdo": "NrOfTXPDO",
    "lss_supported": "LSS_Supported",
    **{f"baudrate_{rate}": f"BaudRate_{rate}" for rate in (10, 20, 50, 125, 250, 500, 800, 1000)},
}


def render_eds(eds: EdsFile) -> str:
    """Return the text of a file which every reader understands as `eds`."""
    lines = [
        f"; Written by `cdpr drive import` from {_one_line(eds.path.name)}, its flaws mended.",
        *_section("FileInfo", {"FileName": _one_line(eds.path.name), "EDSVersion": "4.0"}),
        *_section("DeviceInfo", _info(eds)),
    ]
    if eds.node_id is not None or eds.bitrate_bit_s is not None:
        commissioning = {}
        if eds.node_id is not None:
            commissioning["NodeID"] = str(eds.node_id)
        if eds.bitrate_bit_s is not None:
            commissioning["Baudrate"] = str(eds.bitrate_bit_s // 1000)
        lines += _section("DeviceComissioning", commissioning)
    usage = {f"Dummy{n:04d}": str(int(n in eds.dummies)) for n in range(1, 8)}
    lines += _section("DummyUsage", usage)
    indexes = sorted({index for index, _ in eds.objects} | set(eds.records))
    manufacturer_objects = [i for i in indexes if 0x2000 <= i < 0x6000]
    others = [i for i in indexes if i not in manufacturer_objects and i not in _MANDATORY]
    for name, listed in (
        ("MandatoryObjects", [i for i in indexes if i in _MANDATORY]),
        ("OptionalObjects", others),
        ("ManufacturerObjects", manufacturer_objects),
    ):
        numbered = {str(n): f"0x{index:04X}" for n, index in enumerate(listed, 1)}
        lines += _section(name, {"SupportedObjects": str(len(listed)), **numbered})
    for index in indexes:
        lines += _object(index, eds)
    return "\n".join(lines) + "\n"


def _info(eds: EdsFile) -> dict[str, str]:
    info = {name: eds.info[key] for key, name in _WORDS.items() if key in eds.info}
    for key, name in _NUMBERS.items():
        value = integer(eds.info.get(key, ""))
        if value is not None:
            info[name] = str(value)
    return info


def _object(index: int, eds: EdsFile) -> Iterable[str]:
    if index not in eds.records:
        yield from _entry(f"{index:04X}", eds.objects[index, 0])
        return
    name, kind = eds.records[index]
    entries = sorted((o for (i, _), o in eds.objects.items() if i == index), key=lambda o: o.sub)
    head = {"ParameterName": name, "ObjectType": f"0x{kind:X}", "SubNumber": str(len(entries))}
    yield from _section(f"{index:04X}", head)
    for entry in entries:
        yield from _entry(f"{index:04X}sub{entry.sub:X}", entry)


def _entry(section: str, entry: EdsObject) -> list[str]:
    keys = {
        "ParameterName": entry.name,
        "ObjectType": "0x7",
        "DataType": f"0x{entry.data_type:04X}",
        "AccessType": entry.access,
        "LowLimit": _text(entry.low),
        "HighLimit": _text(entry.high),
        "DefaultValue": _text(entry.default, relative=entry.relative),
        "ParameterValue": _text(entry.value, relative=entry.value_relative),
        "PDOMapping": str(int(entry.mappable)),
    }
    return _section(section, {key: value for key, value in keys.items() if value})


def _text(value: Value | None, *, relative: bool = False) -> str:
    if value is None:
        return ""
    return f"$NODEID+0x{value:X}" if relative and isinstance(value, int) else str(value)


def _one_line(text: str) -> str:
    return " ".join(text.split())


def _section(name: str, keys: dict[str, str]) -> list[str]:
    return ["", f"[{name}]", *(f"{key}={value}" for key, value in keys.items())]

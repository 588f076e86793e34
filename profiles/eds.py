"""Read manufacturers' EDS and DCF files (CiA 306) into dictionaries of `canopen`."""

from __future__ import annotations

import codecs
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import cast

from canopen.objectdictionary import (
    ObjectDictionary,
    ODArray,
    ODRecord,
    ODVariable,
    datatypes,
)

from cdpr_profiles.bounded_input import read_bytes
from cdpr_profiles.errors import ProfileError, value_text

MOST_EDS_BYTES = 2 << 20
_MOST_OBJECTS = 20_000
"""Maximum number of sections, including those that the short forms imply."""
_MOST_REMARKS = 200
_MOST_PDOS = 512
_PDO_ENTRIES = 8
_PREDEFINED = 4
_OFF = 0x80000000
_CONSUMER, _CONSUMER_TIME = 0x1016, 0xFFFF
"""Consumer heartbeat time (CiA 301): the node id is above the 16 bits of the time."""

_HEADER = re.compile(r"\[([^\]]*)\]\s*(?:;.*)?")
_COMMENT = re.compile(r"\s;.*")
_OBJECT = re.compile(r"([0-9a-f]{4})(?:sub([0-9a-f]{1,2}))?", re.ASCII)
_NUMBER = re.compile(r"(-?)(?:0[xX]([0-9a-fA-F]{1,16})|([0-9]{1,20}))", re.ASCII)
_NODE_ID = re.compile(r"\$NODEID(?:\s*\+\s*(\w+))?|(\w+)\s*\+\s*\$NODEID", re.I | re.ASCII)

_DOMAIN, _VAR, _ARRAY, _RECORD = 2, 7, 8, 9
_DEFINITIONS = (0, 5, 6)
"""NULL, DEFTYPE, DEFSTRUCT: not accessible as objects."""
_ACCESS = ("ro", "wo", "rw", "rwr", "rww", "const")
_STRINGS = (datatypes.VISIBLE_STRING, datatypes.UNICODE_STRING)
_OCTETS = (datatypes.OCTET_STRING, datatypes.DOMAIN)
_TYPES = (
    *(datatypes.BOOLEAN, *datatypes.INTEGER_TYPES, *datatypes.FLOAT_TYPES, *datatypes.DATA_TYPES),
    *(datatypes.TIME_OF_DAY, datatypes.TIME_DIFFERENCE),
)
_BITRATES_kbit_s = (10, 20, 50, 125, 250, 500, 800, 1000)
_PDO_PARAMETERS = {
    1: ("COB-ID", "0x0007"),
    2: ("Transmission type", "0x0005"),
    3: ("Inhibit time", "0x0006"),
    4: ("Compatibility entry", "0x0005"),
    5: ("Event timer", "0x0006"),
    6: ("SYNC start value", "0x0005"),
}
Value = int | float | str | bytes


class Remarks:
    """Tolerated errors of a file; `texts` name section, key and value."""

    def __init__(self) -> None:
        self.texts: list[str] = []
        self.omitted = 0
        """Number of remarks that are not kept because there are too many."""

    def add(self, place: str, problem: str) -> None:
        """Record a problem at a place such as "[6040] DataType"."""
        text = f"{place}: {problem}" if place else problem
        if text in self.texts:
            return
        if len(self.texts) < _MOST_REMARKS:
            self.texts.append(text)
        else:
            self.omitted += 1


@dataclass
class DataSheet:
    """Content of an EDS or DCF, with `remarks` on parts that could not be understood.

    Defaults and values that depend on the node id are those for the node id given when reading.
    """

    path: Path
    od: ObjectDictionary = field(default_factory=ObjectDictionary)
    """The objects and the device information; `node_id` and `bitrate` are those of a DCF."""
    remarks: Remarks = field(default_factory=Remarks)
    relative_values: set[tuple[int, int]] = field(default_factory=set)
    """Index and sub-index of DCF values that are relative to the node id."""

    def get(self, index: int, sub: int = 0) -> ODVariable | None:
        """Return an object, None if the file does not contain it."""
        found = self.od.indices.get(index)
        if isinstance(found, ODVariable):
            return found if sub == 0 else None
        return None if found is None else found.subindices.get(sub)

    def subs(self, index: int) -> list[ODVariable]:
        """Return the entries of an array or record except its count, by sub-index."""
        found = self.od.indices.get(index)
        if found is None or isinstance(found, ODVariable):
            return []
        return [entry for sub, entry in sorted(found.subindices.items()) if sub]

    def require(self, index: int, why: str) -> ODVariable | ODRecord | ODArray:
        """Return an object or record; raises ProfileError with its remarks if it is missing."""
        found: ODVariable | ODRecord | ODArray | None = self.od.indices.get(index)
        if found is None:
            place = f"[{index:04X}"
            about = [text for text in self.remarks.texts if text.upper().startswith(place)]
            raise ProfileError(self.path, place + "]", "; ".join([f"is missing; {why}", *about]))
        return found


@dataclass
class _Section:
    """One section: its name as written, and its keys in lower case."""

    name: str
    keys: dict[str, str] = field(default_factory=dict)
    spelling: dict[str, str] = field(default_factory=dict)

    def get(self, key: str) -> str:
        """Return the value of a key in any spelling, "" if it is missing or empty."""
        return self.keys.get(key.lower(), "")

    def place(self, key: str = "") -> str:
        """Return the name of this section, or of a key in it, for messages."""
        return f"[{self.name}] {self.spelling.get(key, key)}".strip()


class _Sections(dict[str, _Section]):
    """The sections of a file, by their names in lower case."""

    def __init__(self, sheet: DataSheet) -> None:
        super().__init__()
        self.path, self.remarks = sheet.path, sheet.remarks

    def put(self, section: _Section) -> _Section:
        """Add a section unless the file has it; return the one with this name."""
        if len(self) >= _MOST_OBJECTS:
            problem = f"more than {_MOST_OBJECTS} objects; allowed: up to {_MOST_OBJECTS}"
            raise ProfileError(self.path, "", problem)
        return self.setdefault(section.name.lower(), section)

    def add(self, name: str, title: str, data_type: str, access: str, value: str) -> _Section:
        """Add an entry unless the file has it; return the one with this name."""
        keys = {"parametername": title, "datatype": data_type}
        return self.put(_Section(name, keys | {"accesstype": access, "defaultvalue": value}))

    def add_record(self, index: int, name: str) -> None:
        """Add the first section of a record unless the file has it."""
        keys = {"parametername": name, "objecttype": hex(_RECORD)}
        self.put(_Section(f"{index:04X}", keys))


def load_dictionary(path: Path, node_id: int = 0) -> ObjectDictionary:
    """Return the objects of an EDS or DCF with their defaults for a node; do not change them.

    Raises ProfileError if the file is not an EDS.
    """
    return _dictionary(path, read_bytes(path, MOST_EDS_BYTES), node_id)


@lru_cache(maxsize=64)
def _dictionary(path: Path, content: bytes, node_id: int) -> ObjectDictionary:
    return _sheet(path, content, node_id).od


def read_eds(path: Path) -> DataSheet:
    """Return the content of an EDS or DCF with remarks on its errors; raises ProfileError."""
    return _sheet(path, read_bytes(path, MOST_EDS_BYTES), 0)


def _sheet(path: Path, content: bytes, node_id: int) -> DataSheet:
    sheet = DataSheet(path)
    sections = _sections(sheet, _decoded(content, sheet.remarks))
    _read_device(sections, sheet)
    _expand(sections)
    heads: dict[int, _Section] = {}
    entries: dict[int, dict[int, _Section]] = {}
    for name, section in sections.items():
        match = _OBJECT.fullmatch(name)
        if match is None:
            continue
        index = int(match[1], 16)
        if match[2] is None:
            heads[index] = section
        else:
            entries.setdefault(index, {})[int(match[2], 16)] = section
    reader = _Objects(sections, sheet, node_id)
    for index, head in heads.items():
        reader.add(index, head, entries.pop(index, {}))
    for index, orphans in entries.items():
        for section in orphans.values() if index >= 0x1000 else ():
            problem = f"no section [{index:04X}] describes it; left out"
            sheet.remarks.add(section.place(), problem)
    sheet.require(0x1000, "every CANopen device has this object")
    return sheet


# The text: encoding, sections, keys and numbers.


def _decoded(content: bytes, remarks: Remarks) -> str:
    for mark, encoding in (
        (codecs.BOM_UTF8, "utf-8"),
        (codecs.BOM_UTF16_LE, "utf-16-le"),
        (codecs.BOM_UTF16_BE, "utf-16-be"),
    ):
        if content.startswith(mark):
            remarks.add("", f"begins with the byte order mark of {encoding.upper()}")
            return content[len(mark) :].decode(encoding, errors="replace")
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError as error:
        remarks.add("", f"is not UTF-8 text (byte {error.start}); read as Windows-1252")
        return content.decode("cp1252", errors="replace")


def _sections(sheet: DataSheet, text: str) -> _Sections:
    """Return the sections by name in lower case; the first value of a repeated key counts."""
    sections, remarks = _Sections(sheet), sheet.remarks
    section = None
    for number, raw in enumerate(text.splitlines(), 1):
        line = raw.strip()
        if not line or line[0] in ";#":
            continue
        if line[0] == "[":
            section = _begin(line, number, sections)
            continue
        key, equals, value = (part.strip() for part in line.partition("="))
        if section is None:
            remarks.add(f"line {number}", f"{value_text(line)} is in no section; left out")
        elif not equals or not key:
            remarks.add(f"line {number}", f"{value_text(line)} is not KEY=VALUE; left out")
        else:
            value = _COMMENT.sub("", " " + value).strip()
            section.spelling.setdefault(key.lower(), key)
            first = section.keys.setdefault(key.lower(), value)
            if first != value:
                problem = f"is given twice; the first value counts, not {value_text(value)}"
                remarks.add(section.place(key), problem)
    if not sections:
        problem = "is not an EDS or DCF: it has no section such as [DeviceInfo] or [1000]"
        raise ProfileError(sheet.path, "", problem)
    return sections


def _begin(line: str, number: int, sections: _Sections) -> _Section:
    """Return the section that a header begins; the keys of a broken header are dropped."""
    match = _HEADER.fullmatch(line)
    if match is None or not match[1].strip():
        problem = f"{value_text(line)} is not a section; left out with its keys"
        sections.remarks.add(f"line {number}", problem)
        return _Section("")
    name = match[1].strip()
    if name.lower() in sections:
        sections.remarks.add(f"[{name}]", "appears twice; the first value of each key counts")
    return sections.put(_Section(name))


def integer(text: str) -> int | None:
    """Return a decimal, hexadecimal (0x) or octal (leading 0) integer, None for anything else."""
    match = _NUMBER.fullmatch(text.strip())
    if match is None:
        return None
    sign = -1 if match[1] else 1
    if match[2]:
        return sign * int(match[2], 16)
    digits = match[3]
    octal = len(digits) > 1 and digits[0] == "0" and not set(digits) & {"8", "9"}
    return sign * int(digits, 8 if octal else 10)


# The device, and the short forms (CompactSubObj, CompactPDO), which are expanded to sections.


def _read_device(sections: _Sections, sheet: DataSheet) -> None:
    """Read the device information; the standard spells [DeviceComissioning] with one m."""
    device, remarks = sheet.od.device_information, sheet.remarks
    info = sections.get("deviceinfo")
    if info is None:
        remarks.add("[DeviceInfo]", "is missing")
        info = _Section("DeviceInfo")
    device.vendor_name, device.product_name = info.get("VendorName"), info.get("ProductName")
    for key in ("vendor_number", "product_number", "revision_number"):
        setattr(device, key, _number(info, key.title().replace("_", ""), None, remarks))
    for rate in _BITRATES_kbit_s:
        if _number(info, f"BaudRate_{rate}", None, remarks):
            device.allowed_baudrates.add(rate * 1000)
    usage = sections.get("dummyusage", _Section("DummyUsage"))
    for data_type in range(1, 8):
        name = f"Dummy{data_type:04d}"
        if integer(usage.get(name)) == 1:
            dummy = ODVariable(name, data_type)
            dummy.data_type, dummy.access_type = data_type, "const"
            sheet.od.add_object(dummy)
    own = sections.get("devicecomissioning") or sections.get("devicecommissioning")
    if own is not None:
        sheet.od.node_id = _number(own, "NodeID", range(1, 128), remarks)
        kbit_s = _number(own, "Baudrate", _BITRATES_kbit_s, remarks)
        sheet.od.bitrate = None if kbit_s is None else kbit_s * 1000


def _number(
    section: _Section, key: str, allowed: Sequence[int] | None, remarks: Remarks
) -> int | None:
    """Return an integer key; None, with a remark, if not in `allowed` (None allows any)."""
    text = section.get(key)
    value = integer(text)
    if value is not None and (allowed is None or value in allowed):
        return value
    if text:
        words = "a number" if allowed is None else ", ".join(map(str, allowed))
        if isinstance(allowed, range):
            words = f"{allowed[0]} to {allowed[-1]}"
        remarks.add(section.place(key), f"value {value_text(text)}; allowed: {words}")
    return None


def _expand(sections: _Sections) -> None:
    """Add the sections that the short forms of a file imply."""
    for key in [key for key in sections if _OBJECT.fullmatch(key)]:
        if sections[key].get("CompactSubObj"):
            _expand_array(key, sections)
    info = sections.get("deviceinfo", _Section("DeviceInfo"))
    present = integer(info.get("CompactPDO")) or 0
    for count_key, first, identifier in (
        ("NrOfRXPDO", 0x1400, 0x200),
        ("NrOfTXPDO", 0x1800, 0x180),
    ):
        count = _number(info, count_key, range(_MOST_PDOS + 1), sections.remarks) or 0
        if present <= 0 or not count:
            continue
        for i in range(count):
            cob_id = f"$NODEID+{identifier + i * 0x100:#x}" if i < _PREDEFINED else hex(_OFF)
            _add_pdo(sections, first + i, present, cob_id)
        problem = "not described individually; assumed to be PDOs that can be mapped"
        sections.remarks.add(info.place("CompactPDO"), f"{count_key}={count}: {problem}")


def _expand_array(key: str, sections: _Sections) -> None:
    """Expand an array of equal entries; names and values may be given in separate sections."""
    head = sections[key]
    count = _number(head, "CompactSubObj", range(255), sections.remarks)
    if not count:
        return
    names, values, given = (
        sections.get(key + part, _Section("")) for part in ("name", "value", "parametervalue")
    )
    sections.add(f"{head.name}sub0", "Number of entries", "0x0005", "ro", str(count))
    for sub in range(1, count + 1):
        name = names.get(str(sub)) or f"{head.get('ParameterName')}{sub}"
        default = values.get(str(sub)) or head.get("DefaultValue")
        kind, access = head.get("DataType"), head.get("AccessType")
        entry = sections.add(f"{head.name}sub{sub:X}", name, kind, access, default)
        for limit in ("PDOMapping", "LowLimit", "HighLimit"):
            entry.keys.setdefault(limit.lower(), head.get(limit))
        entry.keys.setdefault("parametervalue", given.get(str(sub)))
    head.keys["objecttype"] = head.get("ObjectType") or hex(_ARRAY)


def _add_pdo(sections: _Sections, index: int, present: int, cob_id: str) -> None:
    """Add a PDO that [DeviceInfo] only counts; CompactPDO gives its sub-indices."""
    subs = [sub for sub in _PDO_PARAMETERS if present >> (sub - 1) & 1]
    if f"{index:04x}" not in sections and subs:
        sections.add_record(index, "PDO communication parameter")
        sections.add(f"{index:04X}sub0", "Highest sub-index", "0x5", "ro", str(max(subs)))
        defaults = {1: cob_id, 2: "255"}
        for sub in subs:
            name, data_type = _PDO_PARAMETERS[sub]
            default = defaults.get(sub, "0")
            sections.add(f"{index:04X}sub{sub:X}", name, data_type, "rw", default)
    mapping = f"{index + 0x200:04X}"
    if mapping.lower() not in sections:
        sections.add_record(index + 0x200, "PDO mapping parameter")
        sections.add(f"{mapping}sub0", "Mapped objects", "0x5", "rw", "0")
        for sub in range(1, _PDO_ENTRIES + 1):
            sections.add(f"{mapping}sub{sub:X}", f"Object {sub}", "0x7", "rw", "0")


class _Objects:
    """Turns sections into objects of a dictionary, with remarks on their errors."""

    def __init__(self, sections: _Sections, sheet: DataSheet, node_id: int) -> None:
        self._sections = sections
        self._sheet = sheet
        self._remarks = sheet.remarks
        self._node_id = node_id

    def add(self, index: int, head: _Section, entries: dict[int, _Section]) -> None:
        """Add the variable, array or record of a section if its type can be determined."""
        od, kind = self._sheet.od, self._kind(head, bool(entries))
        if kind in (_VAR, _DOMAIN):
            variable = self._variable(head, index, 0, datatypes.DOMAIN if kind == _DOMAIN else None)
            if variable is not None:
                od.add_object(variable)
            for section in entries.values():
                problem = f"{index:04X}h is a variable, without sub-indices; left out"
                self._remarks.add(section.place(), problem)
        elif kind in (_ARRAY, _RECORD):
            name = head.get("ParameterName") or f"Object {index:04X}h"
            record = (ODArray if kind == _ARRAY else ODRecord)(name, index)
            for sub, section in sorted(entries.items()):
                variable = self._variable(section, index, sub)
                if variable is not None:
                    record.add_member(variable)
            od.add_object(record)

    def _kind(self, head: _Section, has_entries: bool) -> int:
        text = head.get("ObjectType")
        kind = integer(text) if text else _VAR  # CiA 306: the default is a variable
        if kind in (_DOMAIN, _ARRAY, _RECORD, *_DEFINITIONS):
            return int(kind or 0)
        if kind != _VAR:
            problem = f"value {value_text(text)}; allowed: 0x7, 0x8, 0x9"
            self._remarks.add(head.place("ObjectType"), problem)
            return _RECORD if has_entries else _VAR
        if has_entries and not head.get("DataType"):
            problem = "a variable with sub-indices; assumed to be a record"
            self._remarks.add(head.place("ObjectType"), problem)
            return _RECORD
        return _VAR

    def _variable(
        self, section: _Section, index: int, sub: int, usual_type: int | None = None
    ) -> ODVariable | None:
        name = section.get("ParameterName")
        if not name:
            self._remarks.add(section.place("ParameterName"), "is missing")
            name = f"Object {index:04X}h"
        variable = ODVariable(name, index, sub)
        data_type = self._data_type(section, usual_type)
        if data_type is None:
            return None
        variable.data_type = data_type
        variable.access_type = section.get("AccessType").lower()
        if variable.access_type not in _ACCESS:
            problem = (
                f"value {value_text(section.get('AccessType'))}; allowed: {', '.join(_ACCESS)}"
            )
            self._remarks.add(section.place("AccessType"), f"{problem}; assumed to be ro")
            variable.access_type = "ro"
        variable.pdo_mappable = bool(_number(section, "PDOMapping", (0, 1), self._remarks))
        if data_type in (datatypes.BOOLEAN, *datatypes.INTEGER_TYPES):
            low, high = (self._integer(section, key, variable) for key in ("LowLimit", "HighLimit"))
            if low is not None and high is not None and low > high:
                problem = f"value {low} is above HighLimit {high}; both left out"
                self._remarks.add(section.place("LowLimit"), problem)
            elif index == _CONSUMER and sub and high is not None and high <= _CONSUMER_TIME:
                problem = f"value {high} leaves no room for a node id; left out"
                self._remarks.add(section.place("HighLimit"), problem)
            else:
                variable.min, variable.max = low, high
        # the package's annotations only allow integers
        variable.default = cast("int | None", self._value(section, "DefaultValue", variable))
        variable.value = cast("int | None", self._value(section, "ParameterValue", variable))
        variable.relative = _NODE_ID.fullmatch(section.get("DefaultValue")) is not None
        if _NODE_ID.fullmatch(section.get("ParameterValue")):
            self._sheet.relative_values.add((index, sub))
        return variable

    def _data_type(self, section: _Section, usual: int | None) -> int | None:
        """Return the type's code; the one of plain bytes if unknown, None if the key is missing."""
        text = section.get("DataType")
        data_type = integer(text) if text or usual is None else usual
        if data_type is not None and data_type > max(_TYPES):
            # CANFestival describes a type with limits as a separate object
            base = self._sections.get(f"{data_type:x}sub1")
            data_type = data_type if base is None else integer(base.get("DefaultValue"))
        place = section.place("DataType")
        if data_type is None or data_type < 1:
            problem = f"value {value_text(text)}" if text else "is missing"
            allowed = "allowed: a type of CiA 301, 0x0001 to 0x001B; the object is left out"
            self._remarks.add(place, f"{problem}; {allowed}")
            return None
        if data_type in _TYPES:
            return data_type
        problem = f"value {value_text(text)} is not a type of CiA 301 (0x0001 to 0x001B)"
        self._remarks.add(place, f"{problem}; assumed to be plain bytes")
        return int(datatypes.DOMAIN)

    def _value(self, section: _Section, key: str, variable: ODVariable) -> Value | None:
        """Return the value of a key, converted to the variable's type; None if missing or wrong."""
        text, data_type = section.get(key), variable.data_type
        if not text or data_type in _STRINGS:
            return text or None
        if data_type not in (*datatypes.FLOAT_TYPES, *_OCTETS):
            return self._integer(section, key, variable)
        is_real = data_type in datatypes.FLOAT_TYPES
        try:
            value = float(text) if is_real else bytes.fromhex(text)
            if isinstance(value, bytes) or math.isfinite(value):
                return value
        except ValueError:
            pass
        if data_type != datatypes.DOMAIN:
            allowed = "a number" if is_real else "pairs of hexadecimal digits"
            problem = f"value {value_text(text)}; allowed: {allowed}; left out"
            self._remarks.add(section.place(key), problem)
        return None

    def _integer(self, section: _Section, key: str, variable: ODVariable) -> int | None:
        text = section.get(key)
        if not text:
            return None
        node = _NODE_ID.fullmatch(text)
        value = integer(text if node is None else node[1] or node[2] or "0")
        bits = 1 if variable.data_type == datatypes.BOOLEAN else bits_of(variable) or 64
        signed = variable.data_type in datatypes.SIGNED_TYPES
        low, high = (-1 << bits - 1, (1 << bits - 1) - 1) if signed else (0, (1 << bits) - 1)
        if value is not None and signed and high < value < 1 << bits:
            value -= 1 << bits  # the file has the raw bits in hexadecimal
        if value is not None and low <= value <= high:
            return value if node is None else value + self._node_id
        allowed = (
            "a number such as 10, 0x0A or $NODEID+0x180" if value is None else f"{low} to {high}"
        )
        problem = f"value {value_text(text)}; allowed: {allowed}; left out"
        self._remarks.add(section.place(key), problem)
        return None


def bits_of(variable: ODVariable) -> int:
    """Return the size of an object in a PDO; 0 for a type without a fixed size."""
    return len(variable) if variable.fixed_size else 0

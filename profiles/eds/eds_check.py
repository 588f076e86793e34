"""Reads an EDS or DCF into objects, with remarks on its errors."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from cdpr_profiles.eds.eds_compact import expand_compact
from cdpr_profiles.eds.eds_text import Remarks, Section, integer, read_sections
from cdpr_profiles.eds.eds_values import DOMAIN, INTEGER_BITS, Value, data_type_of, limits, value_of
from cdpr_profiles.errors import ProfileError, value_text

_VAR, _ARRAY, _RECORD = 7, 8, 9
_CONTAINERS = (_ARRAY, _RECORD)
_DEFINITIONS = (0, 5, 6)  # NULL, DEFTYPE, DEFSTRUCT: no objects that can be accessed
_ACCESS = ("ro", "wo", "rw", "rwr", "rww", "const")
_OBJECT = re.compile(r"([0-9a-f]{4})(?:sub([0-9a-f]{1,2}))?", re.ASCII)
_LISTS = ("MandatoryObjects", "OptionalObjects", "ManufacturerObjects")
_MANDATORY = (0x1000, 0x1001, 0x1018)
_BITRATES_kbit_s = (10, 20, 50, 125, 250, 500, 800, 1000)
_SHOWN_OBJECTS = 8


@dataclass(frozen=True)
class EdsObject:
    """One object that can be accessed; `default` and `value` (of a DCF) fit its type.

    `relative` and `value_relative` tell that these count from the node id.
    """

    index: int
    sub: int
    name: str
    data_type: int
    access: str
    mappable: bool = False
    default: Value | None = None
    relative: bool = False
    value: Value | None = None
    value_relative: bool = False
    low: int | None = None
    high: int | None = None

    @property
    def writable(self) -> bool:
        """Whether SDO may write it."""
        return self.access in ("rw", "rwr", "rww", "wo")

    @property
    def bits(self) -> int:
        """Size in a PDO; 0 for a type without a fixed size."""
        return {0x08: 32, 0x11: 64}.get(self.data_type, INTEGER_BITS.get(self.data_type, 0))


@dataclass
class EdsFile:
    """Content of an EDS or DCF, with `remarks` on what could not be understood."""

    path: Path
    info: dict[str, str] = field(default_factory=dict)
    """Keys of [DeviceInfo], in lower case."""
    objects: dict[tuple[int, int], EdsObject] = field(default_factory=dict)
    records: dict[int, tuple[str, int]] = field(default_factory=dict)
    """Name and object type of the arrays and records, by index."""
    dummies: tuple[int, ...] = ()
    node_id: int | None = None
    """Of a DCF."""
    bitrate_bit_s: int | None = None
    """Of a DCF."""
    remarks: Remarks = field(default_factory=Remarks)

    def get(self, index: int, sub: int = 0) -> EdsObject | None:
        """Return an object, None where there is none."""
        return self.objects.get((index, sub))

    def has(self, index: int) -> bool:
        """Tell whether there is an object or record with this index."""
        return index in self.records or (index, 0) in self.objects

    def subs(self, index: int) -> list[EdsObject]:
        """Return the entries of an array or record but its count, by sub-index."""
        found = (o for (i, sub), o in self.objects.items() if i == index and sub)
        return sorted(found, key=lambda o: o.sub)

    def number(self, index: int, sub: int = 0) -> int | None:
        """Return an integer as the file has it: a DCF's value, else the default, else None.

        What counts from the node id is returned without it.
        """
        entry = self.get(index, sub)
        if entry is None:
            return None
        value = entry.default if entry.value is None else entry.value
        if isinstance(value, int) and self._is_absolute_pdo_id(entry):
            return value - (self.node_id or 0)
        return value if isinstance(value, int) else None

    def _is_absolute_pdo_id(self, entry: EdsObject) -> bool:
        """Tell whether a DCF gives an identifier with its node id added."""
        pdo = 0x1400 <= entry.index < 0x1600 or 0x1800 <= entry.index < 0x1A00
        return pdo and entry.sub == 1 and entry.value is not None and not entry.value_relative

    def info_number(self, key: str) -> int | None:
        """Return a number of [DeviceInfo], None where there is none."""
        return integer(self.info.get(key.lower(), ""))


def read_eds(path: Path) -> EdsFile:
    """Return the content of an EDS or DCF, with remarks on its errors.

    Raises ProfileError for a file that cannot be read, is no EDS, or lacks 1000h or 1018h.
    """
    eds = EdsFile(path)
    sections = read_sections(path, eds.remarks)
    _read_info(sections, eds)
    _read_commissioning(sections, eds)
    expand_compact(sections, eds.remarks)
    for section in sections.values():
        match = _OBJECT.fullmatch(section.name.lower())
        if match and match[2] is None:
            _read_object(section, int(match[1], 16), sections, eds)
    for section in sections.values():
        match = _OBJECT.fullmatch(section.name.lower())
        if match and match[2] is not None:
            _read_entry(section, int(match[1], 16), int(match[2], 16), eds)
    _check_counts(sections, eds)
    _check_lists(sections, eds)
    for index in _MANDATORY:
        if not eds.has(index):
            problem = "is missing or cannot be read, and every CANopen device has this object"
            if index != 0x1001:
                raise ProfileError(path, f"[{index:04X}]", _with_remarks(problem, index, eds))
            eds.remarks.add(f"[{index:04X}]", problem)
    return eds


def _with_remarks(problem: str, index: int, eds: EdsFile) -> str:
    """Add what has been noted on an object's sections to the reason why it is missing."""
    about = [text for text in eds.remarks.texts if text.lower().startswith(f"[{index:04x}")]
    return "; ".join([problem, *about])


def require(eds: EdsFile, index: int, why: str) -> EdsObject:
    """Return an object without sub-indices; raises ProfileError where the file has none."""
    entry = eds.get(index)
    if entry is None:
        raise ProfileError(
            eds.path, f"[{index:04X}]", _with_remarks(f"is missing; {why}", index, eds)
        )
    return entry


# -- what is no object


def _read_info(sections: dict[str, Section], eds: EdsFile) -> None:
    section = sections.get("deviceinfo")
    if section is None:
        eds.remarks.add("[DeviceInfo]", "is missing")
        section = Section("DeviceInfo")
    words = ("vendorname", "productname", "ordercode")
    for key, value in section.keys.items():
        if value and key not in words and integer(value) is None:
            eds.remarks.add(section.place(key), f"value {value_text(value)}; allowed: a number")
        elif value:
            eds.info[key] = value
    usage = sections.get("dummyusage", Section("DummyUsage"))
    eds.dummies = tuple(n for n in range(1, 8) if integer(usage.get(f"Dummy{n:04d}")) == 1)


def _read_commissioning(sections: dict[str, Section], eds: EdsFile) -> None:
    """Read what makes a DCF of an EDS; the standard spells the section's name with one m."""
    section = sections.get("devicecomissioning") or sections.get("devicecommissioning")
    if section is None:
        return
    checks: tuple[tuple[str, Callable[[int], bool], str], ...] = (
        ("NodeID", lambda n: 1 <= n <= 127, "1 to 127"),
        ("Baudrate", lambda n: n in _BITRATES_kbit_s, ", ".join(map(str, _BITRATES_kbit_s))),
    )
    found = {}
    for key, fits, allowed in checks:
        text = section.get(key)
        value = integer(text)
        if value is not None and fits(value):
            found[key] = value
        elif text:
            eds.remarks.add(section.place(key), f"value {value_text(text)}; allowed: {allowed}")
    eds.node_id = found.get("NodeID")
    eds.bitrate_bit_s = found["Baudrate"] * 1000 if "Baudrate" in found else None


# -- objects


def _read_object(section: Section, index: int, sections: dict[str, Section], eds: EdsFile) -> None:
    text = section.get("ObjectType")
    kind = integer(text) if text else _VAR  # CiA 306: a variable where nothing is said
    has_entries = any(f"{index:04x}sub{sub:x}" in sections for sub in range(256))
    if kind in _DEFINITIONS:
        return
    if kind not in (2, _VAR, *_CONTAINERS):
        eds.remarks.add(
            section.place("ObjectType"), f"value {value_text(text)}; allowed: 0x7, 0x8, 0x9"
        )
        kind = _RECORD if has_entries else _VAR
    if kind == _VAR and has_entries and not section.get("DataType"):
        eds.remarks.add(section.place("ObjectType"), "a variable with sub-indices; taken as record")
        kind = _RECORD
    if kind in _CONTAINERS:
        eds.records[index] = _name(section, index), kind
        return
    if kind == 2 and not section.get("DataType"):
        section.keys["datatype"] = hex(DOMAIN)
    entry = _entry(section, index, 0, eds.remarks)
    if entry is not None:
        eds.objects[index, 0] = entry


def _read_entry(section: Section, index: int, sub: int, eds: EdsFile) -> None:
    if index in eds.records:
        entry = _entry(section, index, sub, eds.remarks)
        if entry is not None:
            eds.objects[index, sub] = entry
    elif (index, 0) in eds.objects:
        eds.remarks.add(
            section.place(), f"{index:04X}h is a variable, without sub-indices; left out"
        )
    elif index >= 0x1000:
        eds.remarks.add(section.place(), f"there is no section [{index:04X}] for it; left out")


def _name(section: Section, index: int) -> str:
    return section.get("ParameterName") or f"Object {index:04X}h"


def _entry(section: Section, index: int, sub: int, remarks: Remarks) -> EdsObject | None:
    """Return the object of a section, None where its type cannot be known."""
    if not section.get("ParameterName"):
        remarks.add(section.place("ParameterName"), "is missing")
    data_type = data_type_of(section, remarks)
    if data_type is None:
        return None
    access = section.get("AccessType").lower()
    if access not in _ACCESS:
        access = value_text(section.get("AccessType"))
        remarks.add(
            section.place("AccessType"),
            f"value {access}; allowed: {', '.join(_ACCESS)}; taken as ro",
        )
        access = "ro"
    mappable = section.get("PDOMapping")
    if mappable and integer(mappable) not in (0, 1):
        remarks.add(section.place("PDOMapping"), f"value {value_text(mappable)}; allowed: 0, 1")
    low, high = limits(section, data_type, remarks)
    default, relative = value_of(section, "DefaultValue", data_type, remarks)
    value, value_relative = value_of(section, "ParameterValue", data_type, remarks)
    return EdsObject(
        index,
        sub,
        _name(section, index),
        data_type,
        access,
        mappable=integer(mappable) == 1,
        default=default,
        relative=relative,
        value=value,
        value_relative=value_relative,
        low=low,
        high=high,
    )


# -- whether the parts agree


def _check_counts(sections: dict[str, Section], eds: EdsFile) -> None:
    counted: dict[int, int] = {}
    for index, _ in eds.objects:
        counted[index] = counted.get(index, 0) + 1
    for index in sorted(eds.records):
        section = sections[f"{index:04x}"]
        text, there = section.get("SubNumber"), counted.get(index, 0)
        if not there:
            eds.remarks.add(section.place(), "has no sub-indices")
        elif integer(text) != there and not section.get("CompactSubObj"):
            problem = f"value {value_text(text)}" if text else "is missing"
            eds.remarks.add(section.place("SubNumber"), f"{problem}; there are {there} sub-indices")


def _check_lists(sections: dict[str, Section], eds: EdsFile) -> None:
    listed: set[int] = set()
    for name in _LISTS:
        section = sections.get(name.lower())
        if section is None:
            eds.remarks.add(f"[{name}]", "is missing")
            continue
        indexes = [integer(value) for _, value in section.numbered()]
        count = section.get("SupportedObjects")
        if integer(count) != len(indexes):
            eds.remarks.add(
                section.place("SupportedObjects"),
                f"value {value_text(count)}; there are {len(indexes)} objects in the list",
            )
        known = {index for index in indexes if index is not None}
        listed |= known
        absent = sorted(i for i in known if f"{i:04x}" not in sections)
        _remark_objects(section.place(), "lists objects without a section", absent, eds.remarks)
    there = {index for index, _ in eds.objects} | set(eds.records)
    extra = sorted(index for index in there - listed if index >= 0x1000)
    _remark_objects("", "objects that no list has", extra, eds.remarks)


def _remark_objects(place: str, what: str, indexes: list[int], remarks: Remarks) -> None:
    if indexes:
        listed = ", ".join(f"{index:04X}h" for index in indexes[:_SHOWN_OBJECTS])
        more = ", ..." if len(indexes) > _SHOWN_OBJECTS else ""
        remarks.add(place, f"{what}: {listed}{more} ({len(indexes)})")

"""Object dictionary of a simulated device: typed values, access rules and hooks of the device."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from canopen.objectdictionary import DeviceInformation, ODArray, ODRecord, ODVariable

from cdpr_profiles.eds import load_dictionary
from cdpr_profiles.errors import ProfileError
from cdpr_sim_bus.canopen.abort import Abort, SdoAbort
from cdpr_sim_bus.errors import SimulatorError

# CANopen data types (CiA 301): byte layout of a value, little endian.

Value = int | float | str | bytes
"""Value of an object: integers and booleans as int, strings as str, domains as bytes."""

VISIBLE_STRING = 0x09
OCTET_STRING = 0x0A
UNICODE_STRING = 0x0B
DOMAIN = 0x0F


@dataclass(frozen=True, slots=True)
class Codec:
    """One data type: its size, its struct letter and the two conversions.

    `size` is None for types of any length. `letter` is empty if `struct` has none; an object of
    such a type cannot be mapped into a PDO.
    """

    size: int | None
    letter: str
    encode: Callable[[Any], bytes]
    decode: Callable[[bytes], Value]
    zero: Value
    low: int | None = None
    high: int | None = None


def _integer(size: int, signed: bool, letter: str) -> Codec:
    bits = 8 * size
    low, high = (-(1 << (bits - 1)), (1 << (bits - 1)) - 1) if signed else (0, (1 << bits) - 1)

    def encode(value: int) -> bytes:
        return int(value).to_bytes(size, "little", signed=signed)

    def decode(data: bytes) -> int:
        return int.from_bytes(data, "little", signed=signed)

    return Codec(size, letter, encode, decode, 0, low, high)


def _real(letter: str) -> Codec:
    layout = struct.Struct("<" + letter)
    return Codec(layout.size, letter, layout.pack, lambda data: float(layout.unpack(data)[0]), 0.0)


def _decode_utf16(data: bytes) -> str:
    try:
        return data.decode("utf-16-le")
    except UnicodeDecodeError as error:
        raise SdoAbort(Abort.INVALID_VALUE) from error


_BYTES = Codec(None, "", bytes, bytes, b"")

_INTEGERS = {
    **{0x02: (1, True, "b"), 0x03: (2, True, "h"), 0x04: (4, True, "i"), 0x15: (8, True, "q")},
    **{0x05: (1, False, "B"), 0x06: (2, False, "H"), 0x07: (4, False, "I"), 0x1B: (8, False, "Q")},
    **{0x10: (3, True, ""), 0x12: (5, True, ""), 0x13: (6, True, ""), 0x14: (7, True, "")},
    **{0x16: (3, False, ""), 0x18: (5, False, ""), 0x19: (6, False, ""), 0x1A: (7, False, "")},
}
"""Bytes, sign and struct letter of the integer types."""

CODECS: dict[int, Codec] = {
    0x01: Codec(1, "B", lambda value: bytes([bool(value)]), lambda data: data[0], 0, 0, 1),
    0x08: _real("f"),
    VISIBLE_STRING: Codec(
        None, "", lambda value: value.encode("latin-1"), lambda data: data.decode("latin-1"), ""
    ),
    OCTET_STRING: _BYTES,
    UNICODE_STRING: Codec(None, "", lambda value: value.encode("utf-16-le"), _decode_utf16, ""),
    0x0C: Codec(6, "", bytes, bytes, bytes(6)),
    0x0D: Codec(6, "", bytes, bytes, bytes(6)),
    DOMAIN: _BYTES,
    0x11: _real("d"),
    **{data_type: _integer(*layout) for data_type, layout in _INTEGERS.items()},
}
"""Codec by data type index (0001h to 001Bh)."""


COMMUNICATION = range(0x1000, 0x2000)
"""Communication profile area, which a communication reset restores."""
APPLICATION = range(0x2000, 0xC000)
"""Manufacturer and device profile areas."""


_IDENTITY, _UNSIGNED32 = 0x1018, 0x07
_MAPPINGS = frozenset((*range(0x1600, 0x1800), *range(0x1A00, 0x1C00)))


class DictionaryError(SimulatorError):
    """The EDS cannot be used, or lacks an object that the device needs."""


class Entry:
    """One object (index, sub-index) with its value.

    A device may keep an entry and assign `value` in its cycle; PDOs use it at their next sampling.
    `getter` replaces the stored value when reading. `hook` is called before a write from the bus is
    stored, and may reject it with `SdoAbort`.
    """

    __slots__ = (
        "access",
        "base_default",
        "codec",
        "default",
        "getter",
        "hidden",
        "high",
        "hook",
        "index",
        "low",
        "mappable",
        "name",
        "relative",
        "stored",
        "sub",
        "value",
    )

    def __init__(
        self, index: int, sub: int, codec: Codec, *, name: str = "", access: str = "rw"
    ) -> None:
        self.index = index
        self.sub = sub
        self.name = name
        self.codec = codec
        self.access = access
        self.low: int | None = codec.low
        self.high: int | None = codec.high
        self.mappable = False
        self.relative = False
        self.hidden = False
        """Whether only the device itself can access it."""
        self.base_default: Value = codec.zero
        self.default: Value = codec.zero
        self.stored: Value | None = None
        self.value: Value = codec.zero
        self.getter: Callable[[], Value] | None = None
        self.hook: Callable[[Value], None] | None = None

    @property
    def readable(self) -> bool:
        """Whether the bus may read the object."""
        return self.access != "wo"

    @property
    def writable(self) -> bool:
        """Whether the bus may write the object."""
        return "w" in self.access

    @property
    def receivable(self) -> bool:
        """Whether an RPDO may carry the object."""
        return self.mappable and self.access in ("wo", "rw", "rww")

    @property
    def transmittable(self) -> bool:
        """Whether a TPDO may carry the object."""
        return self.mappable and self.access in ("ro", "rw", "rwr", "const")

    def read(self) -> Value:
        """Return the present value."""
        return self.value if self.getter is None else self.getter()

    def write(self, value: Value) -> None:
        """Write from the bus, by SDO or PDO: check the range, call the device's hook, then store.

        Raises SdoAbort.
        """
        if self.high is not None and value > self.high:  # type: ignore[operator]
            raise SdoAbort(Abort.VALUE_TOO_HIGH)
        if self.low is not None and value < self.low:  # type: ignore[operator]
            raise SdoAbort(Abort.VALUE_TOO_LOW)
        if self.hook is not None:
            self.hook(value)
        self.value = value

    def read_bytes(self) -> bytes:
        """Return the value as an SDO upload sends it; raises SdoAbort."""
        if not self.readable:
            raise SdoAbort(Abort.WRITE_ONLY)
        return self.codec.encode(self.read())

    def check_length(self, length: int) -> None:
        """Reject a download whose length differs from the type's; raises SdoAbort."""
        size = self.codec.size
        if size is not None and length != size:
            raise SdoAbort(Abort.LENGTH_TOO_HIGH if length > size else Abort.LENGTH_TOO_LOW)

    def write_bytes(self, data: bytes) -> None:
        """Write the data of a permitted SDO download; raises SdoAbort."""
        self.check_length(len(data))
        self.write(self.codec.decode(data))

    def power_on(self) -> None:
        """Set the power-on value: the stored value, else the default."""
        self.value = self.default if self.stored is None else self.stored


class ObjectDictionary:
    """All objects of one device, by index and sub-index."""

    def __init__(self) -> None:
        self._entries: dict[tuple[int, int], Entry] = {}
        self._indexes: set[int] = set()
        self.dummies: frozenset[int] = frozenset()
        """Data types (0001h to 0007h) that an RPDO mapping may use to skip bytes."""
        self.bitrates: frozenset[int] = frozenset()
        """Bit rates the EDS allows, bit/s."""

    @classmethod
    def from_eds(cls, path: str | Path, node_id: int) -> ObjectDictionary:
        """Return the dictionary that an EDS describes, with `$NODEID` defaults for `node_id`.

        Raises DictionaryError if the file cannot be read as an EDS.
        """
        od = cls()
        try:
            parsed = load_dictionary(Path(path))
        except ProfileError as error:
            raise DictionaryError(str(error)) from error
        od.bitrates = frozenset(parsed.device_information.allowed_baudrates)
        od.dummies = frozenset(index for index in parsed if index < COMMUNICATION.start)
        for record in parsed.values():
            if record.index in od.dummies:
                continue
            if isinstance(record, ODVariable):
                od.add(_entry(record))
            else:
                for sub in record.subindices.values():
                    od.add(_entry(sub))
                count = record.subindices.get(0)
                if count is not None and count.default is None and count.value is None:
                    od.entry(record.index).base_default = _default_count(record)
        od._add_identity(parsed.device_information)
        od.set_node_id(node_id)
        for entry in od:
            entry.power_on()
        return od

    def _add_identity(self, info: DeviceInformation) -> None:
        """Complete 1018h from [DeviceInfo]; some manufacturers give the identity only there.

        An object that the EDS lacks is hidden from the bus.
        """
        stated = (info.vendor_number, info.product_number, info.revision_number, None)
        for sub, number in enumerate(stated, 1):
            if (_IDENTITY, sub) not in self:
                entry = Entry(_IDENTITY, sub, CODECS[_UNSIGNED32], access="ro")
                entry.hidden = True
                self.add(entry)
            entry = self.entry(_IDENTITY, sub)
            if not entry.base_default and number is not None and 0 <= number <= 0xFFFFFFFF:
                entry.base_default = number

    def add(self, entry: Entry) -> None:
        """Add an object."""
        self._entries[entry.index, entry.sub] = entry
        if not entry.hidden:
            self._indexes.add(entry.index)

    def __iter__(self) -> Iterator[Entry]:
        return iter(self._entries.values())

    def __contains__(self, key: tuple[int, int]) -> bool:
        return key in self._entries

    def entry(self, index: int, sub: int = 0) -> Entry:
        """Return an entry for the device's own use; raises DictionaryError if it does not exist."""
        try:
            return self._entries[index, sub]
        except KeyError:
            raise DictionaryError(f"object {index:04X}h:{sub:02X}h is not in the EDS") from None

    def find(self, index: int, sub: int) -> Entry:
        """Return the entry that a client named; raises SdoAbort if it does not exist."""
        entry = self._entries.get((index, sub))
        if entry is None or entry.hidden:
            known = index in self._indexes
            raise SdoAbort(Abort.NO_SUBINDEX if known else Abort.NO_OBJECT)
        return entry

    def subs(self, index: int) -> list[Entry]:
        """Return the entries of one index except sub-index 0, in order of sub-index."""
        return sorted(
            (e for (i, sub), e in self._entries.items() if i == index and sub),
            key=lambda e: e.sub,
        )

    def get(self, index: int, sub: int = 0) -> Value:
        """Return a value for the device's own use, without access rules."""
        return self.entry(index, sub).read()

    def get_int(self, index: int, sub: int = 0, default: int | None = None) -> int:
        """Return an integer object's value; `default`, if given, if the EDS lacks the object."""
        if default is not None and (index, sub) not in self._entries:
            return default
        value = self.entry(index, sub).read()
        if not isinstance(value, int):
            raise DictionaryError(f"object {index:04X}h:{sub:02X}h is not an integer")
        return value

    def set(self, index: int, sub: int, value: Value) -> None:
        """Set a value for the device's own use, without access rules, limits or hooks."""
        self.entry(index, sub).value = value

    def set_default(self, index: int, sub: int, value: Value) -> None:
        """Set a default that differs from the EDS: the device's value after a reset."""
        entry = self.entry(index, sub)
        entry.base_default = entry.default = entry.value = value
        entry.relative = False

    def on_read(self, index: int, sub: int, fn: Callable[[], Value]) -> None:
        """Call `fn` for the value whenever it is read, by SDO, PDO or the device."""
        self.entry(index, sub).getter = fn

    def on_write(self, index: int, sub: int, fn: Callable[[Value], None]) -> None:
        """Call `fn` before a write from the bus is stored; it may raise SdoAbort to reject it."""
        self.entry(index, sub).hook = fn

    def set_node_id(self, node_id: int) -> None:
        """Recompute the defaults that the EDS gives relative to the node id."""
        for entry in self:
            base = entry.base_default
            entry.default = base + node_id if entry.relative and isinstance(base, int) else base

    def power_on(self, area: range) -> None:
        """Set the writable objects of an area to their power-on values (stored or default)."""
        for entry in self:
            if entry.index in area and entry.writable:
                entry.power_on()


def _default_count(record: ODRecord | ODArray) -> int:
    """Return a count that the EDS omits; in a PDO map, count only entries with a default."""
    mapped = 0
    if record.index not in _MAPPINGS:
        return int(max(record.subindices))
    while mapped + 1 in record.subindices and record.subindices[mapped + 1].default:
        mapped += 1
    return mapped


def _entry(variable: ODVariable) -> Entry:
    codec = CODECS.get(variable.data_type or DOMAIN, CODECS[DOMAIN])
    entry = Entry(
        variable.index,
        variable.subindex,
        codec,
        name=variable.name,
        access=str(variable.access_type),
    )
    if isinstance(codec.zero, int):
        entry.low = codec.low if variable.min is None else variable.min
        entry.high = codec.high if variable.max is None else variable.max
    entry.mappable = bool(variable.pdo_mappable) and bool(codec.letter)
    entry.relative = bool(variable.relative)
    value = variable.default if variable.value is None else variable.value
    if value is not None:
        entry.base_default = value
    return entry

"""Object dictionary of a simulated device: typed values, access rules and hooks of the device."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import lru_cache
from pathlib import Path

from canopen.objectdictionary import ObjectDictionary as CanopenDictionary
from canopen.objectdictionary import ODVariable

from cdpr_profiles.eds.dictionary import load_dictionary
from cdpr_sim_bus.canopen.abort import Abort, SdoAbort
from cdpr_sim_bus.canopen.dictionary.datatypes import CODECS, DOMAIN, Codec, Value
from cdpr_sim_bus.errors import SimulatorError

COMMUNICATION = range(0x1000, 0x2000)
"""Communication profile area: what a reset of communication restores."""
APPLICATION = range(0x2000, 0xC000)
"""Manufacturer and device profile areas."""


class DictionaryError(SimulatorError):
    """An EDS that cannot be used, or an object the device needs and the EDS lacks."""


class Entry:
    """One object (index, sub-index) with its value.

    A device may hold on to an entry and assign `value` in its cycle; PDOs see it at their next
    sampling. `getter` replaces the stored value on reading; `hook` is asked before a write from
    the bus is stored and may refuse it with `SdoAbort`.
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
        """Whether only the device itself knows of it."""
        self.base_default: Value = codec.zero
        self.default: Value = codec.zero
        self.stored: Value | None = None
        self.value: Value = codec.zero
        self.getter: Callable[[], Value] | None = None
        self.hook: Callable[[Value], None] | None = None

    @property
    def readable(self) -> bool:
        """Whether the bus may read it."""
        return self.access != "wo"

    @property
    def writable(self) -> bool:
        """Whether the bus may write it."""
        return "w" in self.access

    @property
    def receivable(self) -> bool:
        """Whether an RPDO may carry it."""
        return self.mappable and self.access in ("wo", "rw", "rww")

    @property
    def transmittable(self) -> bool:
        """Whether a TPDO may carry it."""
        return self.mappable and self.access in ("ro", "rw", "rwr", "const")

    def read(self) -> Value:
        """Present value."""
        return self.value if self.getter is None else self.getter()

    def write(self, value: Value) -> None:
        """Write from the bus, by SDO or PDO: range check, the device's hook, then the store.

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
        """Value as an SDO upload carries it; raises SdoAbort."""
        if not self.readable:
            raise SdoAbort(Abort.WRITE_ONLY)
        return self.codec.encode(self.read())

    def check_length(self, length: int) -> None:
        """Refuse a download of another length than the type's; raises SdoAbort."""
        size = self.codec.size
        if size is not None and length != size:
            raise SdoAbort(Abort.LENGTH_TOO_HIGH if length > size else Abort.LENGTH_TOO_LOW)

    def write_bytes(self, data: bytes) -> None:
        """Write what a permitted SDO download carried; raises SdoAbort."""
        self.check_length(len(data))
        self.write(self.codec.decode(data))

    def power_on(self) -> None:
        """Take the power-on value: what was stored, else the default."""
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
        """Dictionary an EDS describes; `$NODEID` defaults are taken at `node_id`.

        Raises DictionaryError when the file cannot be read as an EDS.
        """
        od = cls()
        try:
            parsed = _read_eds(path, Path(path).stat().st_mtime_ns)
        except Exception as error:
            raise DictionaryError(f"{path}: not a readable EDS: {error}") from error
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
                    od.entry(record.index).base_default = max(record.subindices)
        od.set_node_id(node_id)
        for entry in od:
            entry.power_on()
        return od

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
        """Entry for the device's own use; raises DictionaryError when there is none."""
        try:
            return self._entries[index, sub]
        except KeyError:
            raise DictionaryError(f"object {index:04X}h:{sub:02X}h is not in the EDS") from None

    def find(self, index: int, sub: int) -> Entry:
        """Entry a client named; raises SdoAbort when there is none."""
        entry = self._entries.get((index, sub))
        if entry is None or entry.hidden:
            known = index in self._indexes
            raise SdoAbort(Abort.NO_SUBINDEX if known else Abort.NO_OBJECT)
        return entry

    def subs(self, index: int) -> list[Entry]:
        """Entries of one index but sub-index 0, in order of sub-index."""
        return sorted(
            (e for (i, sub), e in self._entries.items() if i == index and sub),
            key=lambda e: e.sub,
        )

    def get(self, index: int, sub: int = 0) -> Value:
        """Value for the device's own use, without access rules."""
        return self.entry(index, sub).read()

    def get_int(self, index: int, sub: int = 0, default: int | None = None) -> int:
        """Value of an integer object; `default`, when given, where the EDS has no such object."""
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
        """Give an object another default than the EDS: what the device has after a reset."""
        entry = self.entry(index, sub)
        entry.base_default = entry.default = entry.value = value
        entry.relative = False

    def on_read(self, index: int, sub: int, fn: Callable[[], Value]) -> None:
        """Let `fn` give the value whenever it is read, by SDO, PDO or the device."""
        self.entry(index, sub).getter = fn

    def on_write(self, index: int, sub: int, fn: Callable[[Value], None]) -> None:
        """Call `fn` before a write from the bus is stored; it may raise SdoAbort to refuse."""
        self.entry(index, sub).hook = fn

    def set_node_id(self, node_id: int) -> None:
        """Recompute the defaults that the EDS gives relative to the node id."""
        for entry in self:
            base = entry.base_default
            entry.default = base + node_id if entry.relative and isinstance(base, int) else base

    def power_on(self, area: range) -> None:
        """Put power-on values (stored or default) into the writable objects of an area."""
        for entry in self:
            if entry.index in area and entry.writable:
                entry.power_on()


@lru_cache(maxsize=8)
def _read_eds(path: str | Path, _changed_ns: int) -> CanopenDictionary:
    """Read an EDS, once for all drives of its kind as long as it does not change."""
    return load_dictionary(Path(path), 0)


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

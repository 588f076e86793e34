"""Communication and mapping parameters of one PDO (1400h, 1600h, 1800h, 1A00h and following)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from cdpr_sim_bus.canopen import cob_ids
from cdpr_sim_bus.canopen.abort import Abort, SdoAbort
from cdpr_sim_bus.canopen.dictionary.datatypes import CODECS, Codec, Value
from cdpr_sim_bus.canopen.dictionary.od import DictionaryError, Entry, ObjectDictionary

INVALID = 0x80000000
"""Bit 31 of a COB-ID: the PDO does not exist."""
NO_RTR = 0x40000000
EXTENDED = 0x20000000

MAX_BITS = 64


@dataclass(frozen=True, slots=True)
class PdoParameters:
    """The communication parameters, decoded; times in seconds."""

    exists: bool
    identifier: int
    rtr_allowed: bool
    transmission: int
    inhibit_s: float
    event_s: float
    sync_start: int


@dataclass(frozen=True, slots=True)
class Mapped:
    """One mapped object; `entry` is None for a dummy, which only takes room."""

    codec: Codec
    entry: Entry | None


class PdoRecord:
    """Guards the parameters of one PDO and says when they changed.

    Rules of CiA 301: COB-ID, inhibit time and SYNC start value of an existing PDO stand; its
    mapping can be written only while it does not exist, the entries only while the count is 0,
    and the count is refused when an entry cannot be mapped or the sum exceeds 8 bytes.
    """

    def __init__(
        self, od: ObjectDictionary, number: int, *, transmit: bool, changed: Callable[[], None]
    ) -> None:
        self.number = number
        """From 1, as in RPDO1."""
        self._od = od
        self._transmit = transmit
        self._changed = changed
        self._com = (0x1800 if transmit else 0x1400) + number - 1
        self._map = (0x1A00 if transmit else 0x1600) + number - 1
        hooks: dict[int, Callable[[int], None]] = {
            1: self._write_cob_id,
            2: self._write_transmission,
            3: self._write_while_absent(3),
            5: lambda value: self._store(5, value),
            6: self._write_while_absent(6),
        }
        for sub, hook in hooks.items():
            if (self._com, sub) in od:
                od.on_write(self._com, sub, lambda value, hook=hook: hook(int(value)))  # type: ignore[misc]
        if (self._map, 0) in od:
            od.on_write(self._map, 0, self._write_count)
            for entry in od.subs(self._map):
                entry.hook = self._write_mapping

    def parameters(self) -> PdoParameters:
        """Communication parameters as they stand."""
        cob_id = self._get(1, INVALID)
        return PdoParameters(
            exists=not cob_id & INVALID,
            identifier=cob_id & 0x7FF,
            rtr_allowed=not cob_id & NO_RTR,
            transmission=self._get(2, 255),
            inhibit_s=self._get(3, 0) * 1e-4,
            event_s=self._get(5, 0) * 1e-3,
            sync_start=self._get(6, 0),
        )

    def mapping(self) -> list[Mapped]:
        """Mapped objects in order; raises DictionaryError when the EDS maps what cannot be."""
        count = self._od.get_int(self._map, 0, 0)
        try:
            return self._resolve_all(count)
        except SdoAbort as abort:
            raise DictionaryError(
                f"object {self._map:04X}h: the mapping in the EDS is not possible ({abort})"
            ) from abort

    def _get(self, sub: int, default: int) -> int:
        return self._od.get_int(self._com, sub, default)

    def _store(self, sub: int, value: int) -> None:
        self._od.set(self._com, sub, value)
        self._changed()

    def _exists(self) -> bool:
        return not self._get(1, INVALID) & INVALID

    def _write_cob_id(self, new: int) -> None:
        old = self._get(1, INVALID)
        identifier = new & 0x1FFFFFFF
        if new & EXTENDED or (not new & INVALID and cob_ids.is_restricted(identifier)):
            raise SdoAbort(Abort.INVALID_VALUE)
        if not (old | new) & INVALID and identifier != old & 0x1FFFFFFF:
            raise SdoAbort(Abort.INVALID_VALUE)
        self._store(1, new)

    def _write_transmission(self, value: int) -> None:
        reserved = range(241, 252) if self._transmit else range(241, 254)
        if value in reserved:
            raise SdoAbort(Abort.INVALID_VALUE)
        self._store(2, value)

    def _write_while_absent(self, sub: int) -> Callable[[int], None]:
        def write(value: int) -> None:
            if self._exists() and value != self._get(sub, 0):
                raise SdoAbort(Abort.INVALID_VALUE)
            self._store(sub, value)

        return write

    def _write_count(self, value: Value) -> None:
        if self._exists():
            raise SdoAbort(Abort.DEVICE_STATE)
        self._resolve_all(int(value))
        self._od.set(self._map, 0, value)
        self._changed()

    def _write_mapping(self, value: Value) -> None:
        if self._exists() or self._od.get_int(self._map) != 0:
            raise SdoAbort(Abort.DEVICE_STATE)
        if value:
            self._resolve(int(value))

    def _resolve_all(self, count: int) -> list[Mapped]:
        if count > len(self._od.subs(self._map)):
            raise SdoAbort(Abort.PDO_LENGTH)
        mapped = [self._resolve(self._od.get_int(self._map, sub)) for sub in range(1, count + 1)]
        if sum(8 * (m.codec.size or 0) for m in mapped) > MAX_BITS:
            raise SdoAbort(Abort.PDO_LENGTH)
        return mapped

    def _resolve(self, value: int) -> Mapped:
        index, sub, bits = value >> 16, value >> 8 & 0xFF, value & 0xFF
        if index in self._od.dummies:
            mapped = Mapped(CODECS[index], None)
            allowed = sub == 0 and not self._transmit
        else:
            entry = self._od.find(index, sub)
            mapped = Mapped(entry.codec, entry)
            allowed = entry.transmittable if self._transmit else entry.receivable
        if not allowed or bits != 8 * (mapped.codec.size or 0):
            raise SdoAbort(Abort.NOT_MAPPABLE)
        return mapped

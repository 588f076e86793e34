"""The configuration of a drive as a list of objects, with its stamp for 1020h."""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Iterator
from dataclasses import dataclass

from canopen.objectdictionary import ObjectDictionary, ObjectDictionaryError, ODVariable

from cdpr_drivers.drive_units import torque_settings
from cdpr_drivers.errors import DriverError
from cdpr_profiles import DriveProfile, Pdo

_PDO_OFF, _NO_RTR, _IDENTIFIER = 1 << 31, 1 << 30, 0x1FFFFFFF
_RPDO, _TPDO, _PDOS, _TO_MAPPING = 0x1400, 0x1800, 0x200, 0x200
_APPLICATION = 0x2000
_QUICK_STOP = 3
_SLOW_DOWN_THEN_OFF = 2
_STAMP_DAYS, _STAMP_MS = 0xFFFF, 86_400_000
_COUNT, _HEAD = struct.Struct("<I"), struct.Struct("<HBI")


@dataclass(frozen=True)
class BootSettings:
    """What the master configures in a drive besides its profile."""

    master_node_id: int
    sync_period_s: float
    torque_limit_Nm: float
    rated_torque_Nm: float | None = None
    """What 6076h must hold, and what holds without it; None leaves it unchecked."""
    counts_per_turn: int | None = None
    """Encoder resolution of a drive that has no 608Fh."""
    mandatory: bool = True
    """Whether the others may not start without it (CiA 302-2, 1F81h bit 3)."""


@dataclass(frozen=True)
class Stamp:
    """Configuration date and time as 1020h, 1F26h and 1F27h hold them."""

    days: int
    """1020h:01."""
    ms: int
    """1020h:02."""


@dataclass(frozen=True)
class DcfEntry:
    """One object to write: index, sub-index and the data as SDO carries it."""

    index: int
    sub: int
    data: bytes

    @property
    def value(self) -> int:
        """The data as an unsigned integer."""
        return int.from_bytes(self.data, "little")


@dataclass(frozen=True)
class Configuration:
    """The objects to write into one drive, in this order."""

    entries: tuple[DcfEntry, ...]
    absent: tuple[str, ...] = ()
    """Objects the master would set, which the drive's EDS does not have."""

    def concise_dcf(self) -> bytes:
        """Return it as the DOMAIN of 1F22h (CiA 302): how many, then index, sub, size, data each.

        All numbers are little-endian (U32; U16, U8, U32).
        """
        parts = [_HEAD.pack(e.index, e.sub, len(e.data)) + e.data for e in self.entries]
        return _COUNT.pack(len(parts)) + b"".join(parts)

    def stamp(self) -> Stamp:
        """Return the expected configuration date and time (1F26h, 1F27h).

        Made from the content: two configurations that differ in a byte have different ones, and
        the master needs no memory of its own.
        """
        digest = hashlib.sha256(self.concise_dcf()).digest()
        days, ms = struct.unpack_from("<II", digest)
        return Stamp(1 + days % _STAMP_DAYS, 1 + ms % (_STAMP_MS - 1))

    def blocks(self) -> Iterator[tuple[DcfEntry, ...]]:
        """Yield what can only be compared and written together: a PDO, or one object."""
        block: list[DcfEntry] = []
        for entry in self.entries:
            if block and _pdo_of(block[0]) != _pdo_of(entry):
                yield tuple(block)
                block = []
            block.append(entry)
        if block:
            yield tuple(block)


def _pdo_of(entry: DcfEntry) -> tuple[int, int]:
    """Return what identifies the block of an entry: the PDO's 1400h or 1800h, or the object."""
    for first in (_RPDO, _TPDO):
        if first <= entry.index < first + 2 * _PDOS:
            return first + (entry.index - first) % _PDOS, -1
    return entry.index, entry.sub


def is_pdo(block: tuple[DcfEntry, ...]) -> bool:
    """Return whether a block is that of a PDO."""
    return _pdo_of(block[0])[1] < 0


def is_application(block: tuple[DcfEntry, ...]) -> bool:
    """Return whether a block is of the application, which no reset of communication restores."""
    return block[0].index >= _APPLICATION


def matches(entry: DcfEntry, found: int | None) -> bool:
    """Return whether an object that holds `found` (None: nothing) needs no writing.

    Bit 30 of a PDO's COB-ID (no remote requests) is left to the drive, and of one that is to be
    off only bit 31 counts.
    """
    if found is None:
        return False
    if not _is_cob_id(entry):
        return found % (1 << 8 * len(entry.data)) == entry.value  # of signed types too
    mask = _PDO_OFF if entry.value & _PDO_OFF else _PDO_OFF | _IDENTIFIER
    return found & mask == entry.value & mask


def to_write(entry: DcfEntry, found: int | None, block: tuple[DcfEntry, ...]) -> int:
    """Return what to write for an entry of `block`, when its object holds `found`.

    Whether a PDO may be asked for by a remote frame is left as the drive has it; one that is to
    be off keeps its identifier.
    """
    if found is None or not _is_cob_id(entry):
        return entry.value
    if block[-1].value & _PDO_OFF and _is_cob_id(block[-1]):
        return found | _PDO_OFF
    return entry.value & ~_NO_RTR | found & _NO_RTR


def _is_cob_id(entry: DcfEntry) -> bool:
    in_pdos = _RPDO <= entry.index < _RPDO + _PDOS or _TPDO <= entry.index < _TPDO + _PDOS
    return in_pdos and entry.sub == 1


class _Builder:
    def __init__(self, dictionary: ObjectDictionary) -> None:
        self.dictionary = dictionary
        self.entries: list[DcfEntry] = []
        self.absent: list[str] = []

    def has(self, index: int, sub: int) -> bool:
        if index not in self.dictionary:
            return False
        entry = self.dictionary[index]
        return sub == 0 if isinstance(entry, ODVariable) else sub in entry

    def variable(self, index: int, sub: int) -> ODVariable:
        entry = self.dictionary[index]
        found = entry if isinstance(entry, ODVariable) else entry[sub]
        if not isinstance(found, ODVariable):
            raise DriverError(f"object {index:04X}h:{sub} is not in the drive's EDS")
        return found

    def put(self, index: int, sub: int, value: int) -> None:
        if not self.has(index, sub):
            self.absent.append(f"{index:04X}h:{sub}")
            return
        try:
            data = self.variable(index, sub).encode_raw(value)
        except (struct.error, ObjectDictionaryError, ValueError, TypeError) as error:
            raise DriverError(
                f"object {index:04X}h:{sub} cannot be set to {value}: it does not fit the type "
                f"that the EDS gives it ({error})"
            ) from error
        self.entries.append(DcfEntry(index, sub, bytes(data)))

    def require(self, index: int, sub: int, value: int) -> None:
        if not self.has(index, sub):
            raise DriverError(f"object {index:04X}h:{sub} is not in the drive's EDS")
        self.put(index, sub, value)

    def pdo(self, parameters: int, pdo: Pdo, node_id: int) -> None:
        """Add one PDO as CiA 301 wants it: off, map emptied, filled and counted, on again."""
        mapping = parameters + _TO_MAPPING
        enabled = pdo.cob_id(node_id)
        if self.has(parameters, 1):
            enabled |= int(self.variable(parameters, 1).default or 0) & _NO_RTR
        self.require(parameters, 1, enabled | _PDO_OFF)
        self.require(mapping, 0, 0)
        self.require(parameters, 2, pdo.transmission_type)
        times = (3, round(pdo.inhibit_time_s * 1e4)), (5, round(pdo.event_timer_s * 1e3))
        for sub, value in times:
            if self.has(parameters, sub):
                self.put(parameters, sub, value)
            elif value:
                self.require(parameters, sub, value)
        for sub, entry in enumerate(pdo.entries, 1):
            self.require(mapping, sub, entry.mapping)
        self.require(mapping, 0, len(pdo.entries))
        self.require(parameters, 1, enabled)


def make_configuration(
    profile: DriveProfile,
    dictionary: ObjectDictionary,
    node_id: int,
    settings: BootSettings,
    rated_torque_Nm: float,
    watch_entry: int = 1,
) -> Configuration:
    """Return the configuration that the master writes into a drive.

    `rated_torque_Nm` is what the drive's torque unit refers to, `watch_entry` the sub-index of
    1016h that is to watch the master. PDOs of the EDS that the profile does not have are off: they
    are not in the bus budget. Raises DriverError for what the EDS cannot take.
    """
    build = _Builder(dictionary)
    watch = settings.master_node_id << 16 | round(profile.heartbeat_consumer_s * 1e3)
    build.put(0x1006, 0, round(settings.sync_period_s * 1e6))
    build.put(0x1016, watch_entry, watch)
    build.put(0x1017, 0, round(profile.heartbeat_producer_s * 1e3))
    build.put(0x6007, 0, _QUICK_STOP)  # when the master's heartbeat is lost
    build.put(0x605A, 0, _SLOW_DOWN_THEN_OFF)
    for index, value in torque_settings(profile, rated_torque_Nm, settings.torque_limit_Nm):
        build.put(index, 0, value)
    build.put(0x60B2, 0, 0)  # a torque offset left behind would be added to every torque
    for pdos, first in ((profile.rpdos, _RPDO), (profile.tpdos, _TPDO)):
        used = {first + pdo.number - 1: pdo for pdo in pdos}
        for parameters in range(first, first + _PDOS):
            if parameters in used:
                build.pdo(parameters, used[parameters], node_id)
            elif build.has(parameters, 1):
                default = int(build.variable(parameters, 1).default or 0)
                build.put(parameters, 1, default | _PDO_OFF)
    return Configuration(tuple(build.entries), tuple(build.absent))

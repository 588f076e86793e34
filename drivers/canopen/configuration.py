"""The configuration of a drive as a list of objects, with its stamp for 1020h."""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Iterator
from dataclasses import dataclass

from canopen.objectdictionary import ObjectDictionary, ObjectDictionaryError, ODVariable

from cdpr_drivers.canopen.network import CanNetwork
from cdpr_drivers.canopen.sdo import ABSENT
from cdpr_drivers.drive_units import torque_settings, torque_unit_Nm
from cdpr_drivers.errors import DriverError, SdoAbortError
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
    """Settings that the master configures in a drive in addition to its profile."""

    master_node_id: int
    sync_period_s: float
    torque_limit_Nm: float
    rated_torque_Nm: float | None = None
    """Required value of 6076h, also used if the drive lacks it; None leaves it unchecked."""
    counts_per_turn: int | None = None
    """Encoder resolution of a drive that has no 608Fh."""
    torque_constant_Nm_per_Arms: float = 0.0
    """The motor's torque constant, for a drive that counts torques as currents."""
    mandatory: bool = True
    """Whether other drives may start only with this one (CiA 302-2, 1F81h bit 3)."""


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
    """Objects that the master would set but the drive's EDS does not have."""

    def concise_dcf(self) -> bytes:
        """Return the configuration as the DOMAIN of 1F22h (CiA 302): count, then the entries.

        An entry has index (U16), sub-index (U8), size (U32) and data. All numbers are
        little-endian; the count has 32 bits.


        """
        parts = [_HEAD.pack(e.index, e.sub, len(e.data)) + e.data for e in self.entries]
        return _COUNT.pack(len(parts)) + b"".join(parts)

    def stamp(self) -> Stamp:
        """Return the expected configuration date and time (1F26h, 1F27h).

        It is derived from the content: if two configurations differ in a byte, their stamps differ.
        So the master need not remember what it has written.
        """
        digest = hashlib.sha256(self.concise_dcf()).digest()
        days, ms = struct.unpack_from("<II", digest)
        return Stamp(1 + days % _STAMP_DAYS, 1 + ms % (_STAMP_MS - 1))

    def blocks(self) -> Iterator[tuple[DcfEntry, ...]]:
        """Yield the groups that can only be compared and written together: a PDO, or one object."""
        block: list[DcfEntry] = []
        for entry in self.entries:
            if block and _pdo_of(block[0]) != _pdo_of(entry):
                yield tuple(block)
                block = []
            block.append(entry)
        if block:
            yield tuple(block)


def _pdo_of(entry: DcfEntry) -> tuple[int, int]:
    """Return the key of an entry's block: the PDO's 1400h or 1800h, or the object."""
    for first in (_RPDO, _TPDO):
        if first <= entry.index < first + 2 * _PDOS:
            return first + (entry.index - first) % _PDOS, -1
    return entry.index, entry.sub


def is_pdo(block: tuple[DcfEntry, ...]) -> bool:
    """Return whether a block describes a PDO."""
    return _pdo_of(block[0])[1] < 0


def is_application(block: tuple[DcfEntry, ...]) -> bool:
    """Return whether a block has application objects, which no communication reset restores."""
    return block[0].index >= _APPLICATION


def matches(entry: DcfEntry, found: int | None) -> bool:
    """Return whether an object with the value `found` (None: no value) needs no writing.

    Bit 30 of a PDO's COB-ID (no remote requests) is left to the drive; if the PDO must be off,
    only bit 31 counts.
    """
    if found is None:
        return False
    if not _is_cob_id(entry):
        return found % (1 << 8 * len(entry.data)) == entry.value  # also correct for signed types
    mask = _PDO_OFF if entry.value & _PDO_OFF else _PDO_OFF | _IDENTIFIER
    return found & mask == entry.value & mask


def to_write(entry: DcfEntry, found: int | None, block: tuple[DcfEntry, ...]) -> int:
    """Return the value to write for an entry of `block` if its object now holds `found`.

    The drive's setting whether a remote frame may request a PDO is kept; a PDO that must be off
    keeps its identifier.
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

    def is_fixed(self, index: int, sub: int) -> bool:
        """Return whether the EDS has the object, but does not allow writing it."""
        return self.has(index, sub) and not self.variable(index, sub).writable

    def put(self, index: int, sub: int, value: int) -> None:
        if not self.has(index, sub):
            self.absent.append(f"{index:04X}h:{sub}")
            return
        try:
            data = self.variable(index, sub).encode_raw(value)
        except (struct.error, ObjectDictionaryError, ValueError, TypeError) as error:
            raise DriverError(
                f"object {index:04X}h:{sub} cannot be set to {value}: it does not fit its type "
                f"in the EDS ({error})"
            ) from error
        self.entries.append(DcfEntry(index, sub, bytes(data)))

    def require(self, index: int, sub: int, value: int) -> None:
        if not self.has(index, sub):
            raise DriverError(f"object {index:04X}h:{sub} is not in the drive's EDS")
        self.put(index, sub, value)

    def pdo(self, parameters: int, pdo: Pdo, node_id: int) -> None:
        """Add one PDO in the order of CiA 301: off, map emptied, filled and counted, on again.

        A PDO with a COB-ID that cannot be written is mapped while it is on.
        """
        mapping = parameters + _TO_MAPPING
        enabled = pdo.cob_id(node_id)
        fixed = self.is_fixed(parameters, 1)
        if self.has(parameters, 1):
            enabled |= int(self.variable(parameters, 1).default or 0) & _NO_RTR
        if not fixed:
            self.require(parameters, 1, enabled | _PDO_OFF)
        elif int(self.variable(parameters, 1).default or 0) & (_PDO_OFF | _IDENTIFIER) != (
            enabled & _IDENTIFIER
        ):
            default = int(self.variable(parameters, 1).default or 0)
            raise DriverError(
                f"object {parameters:04X}h:1 cannot be written, and its identifier is "
                f"{default:X}h; the profile needs {pdo.cob_id(node_id):X}h (cob_id_offset "
                f"{pdo.cob_id_offset:X}h)"
            )
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
        if not fixed:
            self.require(parameters, 1, enabled)

    def pdo_off(self, parameters: int) -> None:
        """Switch a PDO off, or empty its map if its COB-ID cannot be written."""
        if not self.is_fixed(parameters, 1):
            default = int(self.variable(parameters, 1).default or 0)
            self.put(parameters, 1, default | _PDO_OFF)
        elif not self.is_fixed(parameters + _TO_MAPPING, 0):
            self.put(parameters + _TO_MAPPING, 0, 0)


def make_configuration(
    profile: DriveProfile,
    dictionary: ObjectDictionary,
    node_id: int,
    settings: BootSettings,
    rated_torque_Nm: float,
    watch_entry: int = 1,
) -> Configuration:
    """Return the configuration that the master writes into a drive.

    `rated_torque_Nm` is the reference of a relative torque unit, `watch_entry` the sub-index of
    1016h that monitors the master. PDOs of the EDS that the profile does not have are switched off,
    because the bus budget excludes them. Raises DriverError for objects that the EDS cannot accept.
    """
    build = _Builder(dictionary)
    watch = settings.master_node_id << 16 | round(profile.heartbeat_consumer_s * 1e3)
    build.put(0x1006, 0, round(settings.sync_period_s * 1e6))
    build.put(0x1016, watch_entry, watch)
    build.put(0x1017, 0, round(profile.heartbeat_producer_s * 1e3))
    build.put(0x6007, 0, _QUICK_STOP)  # if the master's heartbeat is lost
    build.put(0x605A, 0, _SLOW_DOWN_THEN_OFF)
    unit_Nm = torque_unit_Nm(profile, rated_torque_Nm, settings.torque_constant_Nm_per_Arms)
    for index, value in torque_settings(profile, unit_Nm, settings.torque_limit_Nm):
        build.put(index, 0, value)
    build.put(0x60B2, 0, 0)  # an earlier torque offset would be added to every torque
    for pdos, first in ((profile.rpdos, _RPDO), (profile.tpdos, _TPDO)):
        used = {first + pdo.number - 1: pdo for pdo in pdos}
        for parameters in range(first, first + _PDOS):
            if parameters in used:
                build.pdo(parameters, used[parameters], node_id)
            elif build.has(parameters, 1):
                build.pdo_off(parameters)
    return Configuration(tuple(build.entries), tuple(build.absent))


# Writes the differing parts of a configuration into a drive, and has the drive store it.

_VERIFY, _STORE = 0x1020, 0x1010
_SAVE = int.from_bytes(b"save", "little")
_STORE_TIMEOUT_S = 10.0
"""Drives that write their whole memory take several seconds."""
_DOWNLOAD_PDO_OFF = 1 << 31

Block = tuple[DcfEntry, ...]


def configure(
    network: CanNetwork, node_id: int, configuration: Configuration, changed: list[str]
) -> bool:
    """Write into a drive what differs from `configuration`, and append the changes to `changed`.

    If the drive's 1020h holds the stamp of `configuration`, only objects that a communication
    reset does not restore are compared. Afterwards 1020h holds that stamp. Returns
    whether 1020h held the stamp before. Raises SdoError, BusError.
    """
    stamp = configuration.stamp()
    stamp_matched = read_stamp(network, node_id) == stamp
    before = len(changed)
    for block in configuration.blocks():
        if is_application(block) or not stamp_matched:
            _write_block(network, node_id, block, changed)
    if _VERIFY in network.dictionary(node_id) and (not stamp_matched or len(changed) > before):
        # must be last: any later write clears it
        network.write(node_id, _VERIFY, 1, stamp.days)
        network.write(node_id, _VERIFY, 2, stamp.ms)
    return stamp_matched


def read_stamp(network: CanNetwork, node_id: int) -> Stamp | None:
    """Return date and time of the configuration in a drive (1020h); None if it has none."""
    if _VERIFY not in network.dictionary(node_id):
        return None
    days, ms = (network.read_int(node_id, _VERIFY, sub) for sub in (1, 2))
    return Stamp(days, ms) if days or ms else None


def store(network: CanNetwork, node_id: int) -> bool:
    """Let the drive store its parameters (1010h:01); return False if it has no such object.

    Raises BusError, or SdoError if the drive refuses.
    """
    if _STORE not in network.dictionary(node_id):
        return False
    network.write(node_id, _STORE, 1, _SAVE, timeout_s=_STORE_TIMEOUT_S)
    return True


def _write_block(network: CanNetwork, node_id: int, block: Block, changed: list[str]) -> None:
    final = {(entry.index, entry.sub): entry for entry in block}
    found = {key: _found(network, node_id, *key) for key in final}
    if all(matches(entry, found[key]) for key, entry in final.items()):
        return
    for entry in block:
        value = to_write(entry, found[entry.index, entry.sub], block)
        data = value.to_bytes(len(entry.data), "little")
        network.write_bytes(node_id, entry.index, entry.sub, data)
    changed.append(_name(block))


def _found(network: CanNetwork, node_id: int, index: int, sub: int) -> int | None:
    """Return an object's value; None if it does not exist.

    In some drives, the mapping has only as many entries as sub-index 0 says.
    """
    try:
        return network.read_int(node_id, index, sub)
    except SdoAbortError as error:
        if error.code in ABSENT:
            return None
        raise


def _name(block: Block) -> str:
    first = block[0]
    if not is_pdo(block):
        return f"{first.index:04X}h:{first.sub} = {first.value}"
    if block[-1].value & _DOWNLOAD_PDO_OFF and block[-1].sub == 1:
        return f"{first.index:04X}h switched off"
    return f"{first.index:04X}h and {first.index + 0x200:04X}h"

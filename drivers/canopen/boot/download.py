"""Writes a configuration into a drive where it differs, and has the drive store it."""

from __future__ import annotations

from cdpr_drivers.canopen import sdo_abort
from cdpr_drivers.canopen.boot.configuration import (
    Configuration,
    DcfEntry,
    Stamp,
    is_application,
    is_pdo,
    matches,
    to_write,
)
from cdpr_drivers.canopen.network import CanNetwork
from cdpr_drivers.errors import SdoAbortError

_VERIFY, _STORE = 0x1020, 0x1010
_SAVE = int.from_bytes(b"save", "little")
_STORE_TIMEOUT_S = 10.0
"""Drives that write their whole memory take seconds."""
_PDO_OFF = 1 << 31

Block = tuple[DcfEntry, ...]


def configure(
    network: CanNetwork, node_id: int, configuration: Configuration, changed: list[str]
) -> bool:
    """Write into a drive what differs from `configuration`, and append to `changed` what that was.

    Where the drive's 1020h holds the stamp of `configuration`, only objects that a reset of
    communication does not restore are compared. Afterwards 1020h holds that stamp. Returns
    whether 1020h held the stamp before. Raises SdoError, BusError.
    """
    stamp = configuration.stamp()
    stamp_matched = read_stamp(network, node_id) == stamp
    before = len(changed)
    for block in configuration.blocks():
        if is_application(block) or not stamp_matched:
            _write_block(network, node_id, block, changed)
    if _VERIFY in network.dictionary(node_id) and (not stamp_matched or len(changed) > before):
        # last of all: whatever is written after it clears it
        network.write(node_id, _VERIFY, 1, stamp.days)
        network.write(node_id, _VERIFY, 2, stamp.ms)
    return stamp_matched


def read_stamp(network: CanNetwork, node_id: int) -> Stamp | None:
    """Return date and time of the configuration in a drive (1020h), None where there is none."""
    if _VERIFY not in network.dictionary(node_id):
        return None
    days, ms = (network.read_int(node_id, _VERIFY, sub) for sub in (1, 2))
    return Stamp(days, ms) if days or ms else None


def store(network: CanNetwork, node_id: int) -> bool:
    """Have the drive keep its parameters (1010h:01); False where it has no such object.

    Raises SdoError when it refuses, BusError.
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
    """Return an object's value, None where there is none: some drives have the entries of a
    mapping only up to the number in sub-index 0."""
    try:
        return network.read_int(node_id, index, sub)
    except SdoAbortError as error:
        if error.code in sdo_abort.ABSENT:
            return None
        raise


def _name(block: Block) -> str:
    first = block[0]
    if not is_pdo(block):
        return f"{first.index:04X}h:{first.sub} = {first.value}"
    if block[-1].value & _PDO_OFF and block[-1].sub == 1:
        return f"{first.index:04X}h switched off"
    return f"{first.index:04X}h and {first.index + 0x200:04X}h"

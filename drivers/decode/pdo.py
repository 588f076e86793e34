"""PDOs by identifier and their mapping, from profiles and from SDO traffic."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from cdpr_drivers.decode.values import DecodedValue, NodeView, read_field
from cdpr_profiles import Pdo

_FIRST_ID, _LAST_ID = 0x180, 0x57F
_NODE, _FUNCTION = 0x07F, 0x780
_OFF = 1 << 31
_MOST_ENTRIES = 64
# CiA 301, predefined connection set
_PREDEFINED = {
    0x180: ("TPDO", 1),
    0x200: ("RPDO", 1),
    0x280: ("TPDO", 2),
    0x300: ("RPDO", 2),
    0x380: ("TPDO", 3),
    0x400: ("RPDO", 3),
    0x480: ("TPDO", 4),
    0x500: ("RPDO", 4),
}
_BASES = {"RPDO": (0x1400, 0x1600), "TPDO": (0x1800, 0x1A00)}


@dataclass
class PdoView:
    """One PDO of a node, as far as it is known."""

    node: NodeView
    kind: str
    """"TPDO" or "RPDO"."""
    number: int
    count: int | None = None
    """Entries in use; None where not known."""
    entries: dict[int, int] = field(default_factory=dict)
    """Mapping entry (CiA 301: index, sub-index, bits) by position from 1."""

    def read(self, data: bytes) -> tuple[list[DecodedValue], str]:
        """Return the values in a frame, and a note where it does not fit the mapping."""
        values: list[DecodedValue] = []
        start = 0
        for position in range(1, (self.count or 0) + 1):
            entry = self.entries.get(position)
            if entry is None or entry & 7:
                # what lies behind an entry that is not known cannot be found
                return values, f"entry {position} of the map not known: {_hex(data[start:])}"
            end = start + (entry & 0xFF) // 8
            if end > len(data):
                return values, f"{len(data)} bytes, too few for the map"
            if entry >> 16 >= 0x20:  # below lie dummies, which fill gaps
                index, sub = entry >> 16, entry >> 8 & 0xFF
                values.append(read_field(self.node, index, sub, data[start:end]))
            start = end
        if self.count is None and data:
            return values, f"map not known: {_hex(data)}"
        if start < len(data):
            return values, f"{len(data) - start} bytes more than mapped: {_hex(data[start:])}"
        return values, ""


class PdoTable:
    """The PDOs of all nodes by identifier."""

    def __init__(self) -> None:
        self._by_id: dict[int, PdoView] = {}
        self._by_number: dict[tuple[int, str, int], PdoView] = {}

    def load(self, node: NodeView, kind: str, pdos: Iterable[Pdo]) -> None:
        """Take over the PDOs of a node's profile."""
        for pdo in pdos:
            view = self._view(node, kind, pdo.number)
            view.count = len(pdo.entries)
            view.entries = {i: entry.mapping for i, entry in enumerate(pdo.entries, 1)}
            self._by_id[pdo.cob_id(node.node_id)] = view

    def at(self, identifier: int, node: NodeView) -> PdoView | None:
        """Return the PDO with this identifier, by the predefined connection set if need be.

        `node` is whom the identifier belongs to in that set.
        """
        found = self._by_id.get(identifier)
        if found is None and _FIRST_ID <= identifier <= _LAST_ID and identifier & _NODE:
            kind, number = _PREDEFINED[identifier & _FUNCTION]
            found = self._by_id[identifier] = self._view(node, kind, number)
        return found

    def learn(self, node: NodeView, index: int, sub: int, value: int) -> None:
        """Take over what an SDO transfer has shown of a node's PDO parameters and maps."""
        for kind, (parameters, maps) in _BASES.items():
            if parameters <= index < parameters + 0x200 and sub == 1:
                self._move(self._view(node, kind, index - parameters + 1), value)
            elif maps <= index < maps + 0x200:
                view = self._view(node, kind, index - maps + 1)
                if sub == 0:
                    view.count = min(value, _MOST_ENTRIES)
                else:
                    view.entries[sub] = value

    def _view(self, node: NodeView, kind: str, number: int) -> PdoView:
        key = (node.node_id, kind, number)
        if key not in self._by_number:
            self._by_number[key] = PdoView(node, kind, number)
        return self._by_number[key]

    def _move(self, view: PdoView, value: int) -> None:
        """Put a PDO at the identifier which its communication parameter gives."""
        identifier = value & 0x7FF
        if value & _OFF or not identifier:
            return
        for old in [i for i, other in self._by_id.items() if other is view and i != identifier]:
            del self._by_id[old]
        self._by_id[identifier] = view


def _hex(data: bytes) -> str:
    return data.hex(" ").upper()

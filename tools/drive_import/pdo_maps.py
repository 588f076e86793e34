"""PDO maps for torque control out of what an EDS offers: its defaults, else maps of our own."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from cdpr_profiles.eds.eds_check import EdsFile
from cdpr_profiles.errors import ProfileError

CONTROL, TARGET_TORQUE = 0x6040, 0x6071
STATUS, POSITION, TORQUE = 0x6041, 0x6064, 0x6077
_MODE_SHOWN, _PROBE_STATUS, _PROBE_POSITION = 0x6061, 0x60B9, 0x60BA
COMMAND = (CONTROL, TARGET_TORQUE)
FEEDBACK = (STATUS, POSITION, TORQUE)
EXTRA = (_MODE_SHOWN, _PROBE_STATUS, _PROBE_POSITION)
BITS = {
    **{CONTROL: 16, TARGET_TORQUE: 16, STATUS: 16, POSITION: 32, TORQUE: 16},
    **{_MODE_SHOWN: 8, _PROBE_STATUS: 16, _PROBE_POSITION: 32},
}
"""Size that CiA 402 gives to what the cycle exchanges."""
_HARMLESS = (*COMMAND, 0x60B2)
"""What a mapped RPDO may hold: the rest of it is sent as zero in every cycle."""
_MOST_PDOS = 512
_FRAME_BITS = 64
_MOST_ENTRIES = 8
_PREDEFINED = 4
_IDENTIFIER, _NODE = 0x7FF, 0x7F
_EVERY_SYNC, _SYNC_WHEN_CHANGED = 1, 0

Entry = tuple[int, int, int]
"""Index, sub-index and bits."""


@dataclass(frozen=True)
class PdoOffer:
    """One PDO that a drive has; `entries` is its map by default."""

    number: int
    cob_id_offset: int
    entries: tuple[Entry, ...]
    room: int
    """Objects that can be mapped anew, 0 where the map is fixed."""
    type_writable: bool
    transmission_type: int

    @property
    def indexes(self) -> tuple[int, ...]:
        """The mapped objects."""
        return tuple(index for index, _, _ in self.entries)

    def serves(self, transmission_type: int) -> bool:
        """Tell whether it can have a transmission type."""
        return self.type_writable or self.transmission_type == transmission_type

    def table(self, entries: Sequence[Entry], transmission_type: int) -> dict[str, Any]:
        """Return the PDO as a drive profile has it."""
        return {
            "number": self.number,
            "cob_id_offset": self.cob_id_offset,
            "transmission_type": transmission_type,
            "entries": [
                {"index": index, **({"subindex": sub} if sub else {}), "bits": bits}
                for index, sub, bits in entries
            ],
        }


@dataclass(frozen=True)
class Choice:
    """The PDOs of one direction, as a profile has them, and how they came about."""

    pdos: list[dict[str, Any]]
    how: str

    @property
    def indexes(self) -> set[int]:
        """The objects they hold."""
        return {entry["index"] for pdo in self.pdos for entry in pdo["entries"]}


def choose_rpdos(eds: EdsFile) -> Choice:
    """Return RPDOs with controlword and target torque; raises ProfileError where none can be."""
    offers = _offers(eds, 0x1400, 0x200)
    harmless = [offer for offer in offers if set(offer.indexes) <= set(_HARMLESS)]
    return _choose(eds, offers, harmless, COMMAND, "RPDO")


def choose_tpdos(eds: EdsFile) -> Choice:
    """Return TPDOs with statusword, position and torque, and where possible mode and touch probe.

    Raises ProfileError where the first three cannot be had.
    """
    offers = _offers(eds, 0x1800, 0x180)
    choice = _choose(eds, offers, offers, FEEDBACK, "TPDO")
    taken = {pdo["number"] for pdo in choice.pdos}
    extra_objects = [
        index for index in EXTRA if index not in choice.indexes and _mappable(eds, index)
    ]
    if not set(extra_objects) & {_PROBE_STATUS} or not set(extra_objects) & {_PROBE_POSITION}:
        extra_objects = [index for index in extra_objects if index == _MODE_SHOWN]
    for offer in offers:
        if not extra_objects or offer.number in taken or not offer.serves(_SYNC_WHEN_CHANGED):
            continue
        if set(extra_objects) <= set(offer.indexes):
            entries = list(offer.entries)
        elif offer.room:
            entries = [_whole(index) for index in extra_objects[: offer.room]]
        else:
            continue
        extra = offer.table(entries, _SYNC_WHEN_CHANGED)
        return Choice([*choice.pdos, extra], choice.how)
    return choice


def _choose(
    eds: EdsFile,
    offers: list[PdoOffer],
    as_they_are: list[PdoOffer],
    objects: tuple[int, ...],
    kind: str,
) -> Choice:
    """Take one PDO as it is, else map one anew, else spread the objects over several."""
    usable = [offer for offer in offers if offer.serves(_EVERY_SYNC)]
    for offer in as_they_are:
        if offer in usable and set(objects) <= set(offer.indexes):
            return Choice([offer.table(offer.entries, _EVERY_SYNC)], "map by default in the EDS")
    blocked = [index for index in objects if not _mappable(eds, index)]
    entries = [_whole(index) for index in objects]
    for offer in usable:
        if not blocked and offer.room >= len(objects):
            return Choice(
                [offer.table(entries, _EVERY_SYNC)],
                "a map of our own, which by the EDS the drive lets be written",
            )
    spread = _over_several_pdos(usable, as_they_are, objects, lambda index: _mappable(eds, index))
    if spread is not None:
        return Choice(spread, "spread over several PDOs, since none has room for all")
    raise ProfileError(eds.path, kind, _reason(offers, usable, blocked, objects, kind))


def _over_several_pdos(
    usable: Iterable[PdoOffer],
    as_they_are: Iterable[PdoOffer],
    objects: tuple[int, ...],
    mappable: Callable[[int], bool],
) -> list[dict[str, Any]] | None:
    missing = list(objects)
    chosen = []
    for offer in usable:
        if set(missing) & set(offer.indexes) and (offer in as_they_are):
            entries = list(offer.entries)
        elif offer.room:
            entries = [_whole(index) for index in missing if mappable(index)][: offer.room]
        else:
            continue
        if entries:
            chosen.append(offer.table(entries, _EVERY_SYNC))
            missing = [index for index in missing if index not in {e[0] for e in entries}]
        if not missing:
            return chosen
    return None


def _reason(
    offers: list[PdoOffer],
    usable: list[PdoOffer],
    blocked: list[int],
    objects: tuple[int, ...],
    kind: str,
) -> str:
    names = ", ".join(f"{index:04X}h" for index in objects)
    problem = f"no {kind} can carry {names}, which torque control needs: "
    if not offers:
        return problem + f"the file describes no {kind}"
    if not usable:
        return problem + "none can answer every SYNC (transmission type 1 cannot be written)"
    if blocked:
        names = ", ".join(f"[{index:04X}] PDOMapping" for index in blocked)
        return problem + f"{names} is not 1, and no map by default has it"
    return problem + "the maps are fixed, or have too few entries that can be written"


def _offers(eds: EdsFile, first: int, predefined: int) -> list[PdoOffer]:
    return [
        offer
        for number in range(1, _MOST_PDOS + 1)
        if (offer := _offer(eds, first + number - 1, number, predefined)) is not None
    ]


def _offer(eds: EdsFile, index: int, number: int, predefined: int) -> PdoOffer | None:
    """Return a PDO of the file, None where it is not there or has no identifier of its own."""
    if eds.get(index, 1) is None or not eds.subs(index + 0x200):
        return None
    offset = _offset(eds, index, number, predefined)
    kind = eds.get(index, 2)
    if offset is None or kind is None:
        return None
    count = eds.get(index + 0x200)
    places = eds.subs(index + 0x200)
    free = count is not None and count.writable
    room = sum(1 for place in places if place.writable) if free else 0
    return PdoOffer(
        number,
        offset,
        _entries(eds, index + 0x200),
        min(room, _MOST_ENTRIES),
        kind.writable,
        eds.number(index, 2) or 0,
    )


def _offset(eds: EdsFile, index: int, number: int, predefined: int) -> int | None:
    """Return what to add to the node id: as the file says, else the predefined connection set."""
    text = eds.number(index, 1)
    offset = 0 if text is None else text & _IDENTIFIER
    if offset & _NODE or not 0x180 <= offset <= 0x57F:
        offset = predefined + (number - 1) * 0x100 if number <= _PREDEFINED else 0
    return offset or None


def _entries(eds: EdsFile, mapping: int) -> tuple[Entry, ...]:
    """Return a map by default, empty where it does not make sense or fit a frame."""
    count = eds.number(mapping) or 0
    entries = []
    for sub in range(1, min(count, _MOST_ENTRIES) + 1):
        value = eds.number(mapping, sub) or 0
        index, of, bits = value >> 16, value >> 8 & 0xFF, value & 0xFF
        mapped = eds.get(index, of)
        if mapped is None or mapped.bits != bits or bits not in (8, 16, 32):
            eds.remarks.add(
                f"[{mapping:04X}sub{sub:X}]",
                f"maps {index:04X}h:{of} with {bits} bits, which the file does not have so",
            )
            return ()
        entries.append((index, of, bits))
    if sum(bits for *_, bits in entries) > _FRAME_BITS:
        eds.remarks.add(f"[{mapping:04X}]", "maps more than the 64 bits of a frame")
    return tuple(entries) if sum(bits for *_, bits in entries) <= _FRAME_BITS else ()


def _mappable(eds: EdsFile, index: int) -> bool:
    entry = eds.get(index)
    return entry is not None and entry.mappable and entry.bits == BITS[index]


def _whole(index: int) -> Entry:
    return index, 0, BITS[index]

"""Lists of identifiers and node ids as a user writes them."""

from __future__ import annotations

from collections.abc import Iterator

from cdpr_drivers.bus.frames import EFF_FLAG
from cdpr_tools.errors import BadInputError

_LAST = 0x7FF
_LAST_NODE = 127


def parse_identifiers(text: str) -> frozenset[int]:
    """Return the 11-bit identifiers in a list as `181,700-77F`, hexadecimal; BadInputError."""
    allowed = "no identifier; write them hexadecimal up to 7FF, as in 181,700-77F"
    return frozenset(_numbers("--ids", text, 16, range(_LAST + 1), allowed))


def parse_node_ids(text: str) -> list[int]:
    """Return the node ids in a list as `1,5,20-23`, decimal, in their order; BadInputError."""
    allowed = "no node id; allowed: 1 to 127, as in 1,5,20-23"
    return sorted(_numbers("--nodes", text, 10, range(1, _LAST_NODE + 1), allowed))


def _numbers(option: str, text: str, base: int, known: range, allowed: str) -> set[int]:
    found: set[int] = set()
    for part in map(str.strip, text.split(",")):
        first, dash, last = part.partition("-")
        try:
            low = int(first, base)
            high = int(last, base) if dash else low
        except ValueError:
            low, high = 1, 0
        written = (first + last).isalnum()  # int() takes signs, blanks and underscores as well
        if not (written and low in known and high in known and low <= high):
            raise BadInputError(f"{option} {text}: {part!r} is {allowed}")
        found |= set(range(low, high + 1))
    return found


def filters(identifiers: frozenset[int]) -> list[tuple[int, int]]:
    """Return as few pairs (identifier, mask) as let just these 11-bit identifiers through."""
    return list(_blocks(identifiers, 0, _LAST + 1))


def _blocks(identifiers: frozenset[int], start: int, size: int) -> Iterator[tuple[int, int]]:
    """Yield the aligned blocks of a power of two that lie wholly in `identifiers`."""
    inside = sum(1 for i in range(start, start + size) if i in identifiers)
    if inside == size:
        yield start, (_LAST & ~(size - 1)) | EFF_FLAG
    elif inside:
        yield from _blocks(identifiers, start, size // 2)
        yield from _blocks(identifiers, start + size // 2, size // 2)

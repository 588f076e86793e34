"""Lists of identifiers and node ids as a user writes them."""

from __future__ import annotations

from collections.abc import Iterator

from cdpr_drivers.bus.frames import EFF_FLAG
from cdpr_tools.errors import BadInputError

_LAST = 0x7FF
_LAST_NODE = 127


def parse_identifiers(text: str) -> frozenset[int]:
    """Return the 11-bit identifiers in a list as `181,700-77F`, hexadecimal; BadInputError."""
    found: set[int] = set()
    for part in text.split(","):
        first, dash, last = part.strip().partition("-")
        try:
            low = int(first, 16)
            high = int(last, 16) if dash else low
        except ValueError:
            low, high = 1, 0
        if not 0 <= low <= high <= _LAST:
            raise BadInputError(
                f"--ids {text}: {part.strip()!r} is no identifier; write them hexadecimal up to "
                "7FF, as in 181,700-77F"
            )
        found |= set(range(low, high + 1))
    return frozenset(found)


def filters(identifiers: frozenset[int]) -> list[tuple[int, int]]:
    """Return as few pairs (identifier, mask) as let just these 11-bit identifiers through."""
    return list(_blocks(identifiers, 0, _LAST + 1))


def _blocks(wanted: frozenset[int], start: int, size: int) -> Iterator[tuple[int, int]]:
    """Yield the aligned blocks of a power of two that lie wholly in `wanted`."""
    inside = sum(1 for i in range(start, start + size) if i in wanted)
    if inside == size:
        yield start, (_LAST & ~(size - 1)) | EFF_FLAG
    elif inside:
        yield from _blocks(wanted, start, size // 2)
        yield from _blocks(wanted, start + size // 2, size // 2)


def parse_node_ids(text: str) -> list[int]:
    """Return the node ids in a list as `1,5,20-23`, decimal, in their order; BadInputError."""
    found: set[int] = set()
    for part in text.split(","):
        first, dash, last = part.strip().partition("-")
        low = int(first) if first.isdecimal() else 0
        high = (int(last) if last.isdecimal() else 0) if dash else low
        if not 1 <= low <= high <= _LAST_NODE:
            raise BadInputError(
                f"--nodes {text}: {part.strip()!r} is no node id; allowed: 1 to 127, as in "
                "1,5,20-23"
            )
        found |= set(range(low, high + 1))
    return sorted(found)

"""The words of a G-code file: letters with numbers, comments taken out."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from cdpr_rt.motion.path.description import PathError

_COMMENT: Final = re.compile(r"\([^()]*\)")
_WORD: Final = re.compile(r"\s*([A-Za-z])\s*([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+))")
_MOST_DIGITS: Final = 40
_REPEATED: Final = frozenset("GM")


@dataclass(frozen=True)
class Block:
    """One line of a file: its number, its G and M codes, and its other words."""

    line: int
    codes: tuple[str, ...]
    """Such as G1, G20, M2; in their order."""
    words: dict[str, float]
    """By letter, in the units of the file."""


def blocks(text: str, source: str, ignored: frozenset[str] = frozenset()) -> Iterator[Block]:
    """Yield the lines that say something, up to the end of the program.

    `ignored` are letters or codes that are skipped, such as S or M3. Raises PathError for what is
    no word, and for a file that was cut short: one without M2, M30 or its second %.
    """
    percents = 0
    for number, full in enumerate(text.split("\n"), 1):
        line = _COMMENT.sub(" ", full.partition(";")[0]).strip()
        if line.startswith("%"):
            percents += 1
            if percents == 2:
                return
            continue
        if "(" in line or ")" in line:
            raise PathError(source, number, "a comment is not closed; allowed: ( ... ) in one line")
        if not line:
            continue
        block = _block(line.removeprefix("/"), number, source, ignored)
        yield block
        if "M2" in block.codes or "M30" in block.codes:
            return
    last = text.rstrip().count("\n") + 1
    raise PathError(
        source, last, "ends without M2, M30 or a second %: was it cut short? allowed: end with M2"
    )


def _block(line: str, number: int, source: str, ignored: frozenset[str]) -> Block:
    codes: list[str] = []
    words: dict[str, float] = {}
    at = 0
    while at < len(line):
        match = _WORD.match(line, at)
        if match is None or len(match[2]) > _MOST_DIGITS:
            rest = line[at:].strip()
            if not rest:
                break
            raise PathError(
                source, number, f"{rest[:20]!r}: allowed: words such as X12.5; no expressions"
            )
        at = match.end()
        letter, value = match[1].upper(), float(match[2])
        name = f"{letter}{value:g}"
        if letter in ("N", "O") or letter in ignored or name in ignored:
            continue
        if letter in _REPEATED:
            codes.append(name)
        elif letter in words:
            raise PathError(source, number, f"{letter} stands twice in this line")
        else:
            words[letter] = value
    return Block(number, tuple(codes), words)

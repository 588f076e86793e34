"""The text of an EDS or DCF (CiA 306): encoding, sections, keys, numbers; tolerant of flaws."""

from __future__ import annotations

import codecs
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from cdpr_profiles.errors import ProfileError, value_text
from cdpr_profiles.reading.bounded_input import read_bytes

MOST_EDS_BYTES = 2 << 20
_MOST_REMARKS = 200

_HEADER = re.compile(r"\[([^\]]*)\]\s*(?:;.*)?")
_COMMENT = re.compile(r"\s;.*")
_NUMBER = re.compile(r"(-?)(?:0[xX]([0-9a-fA-F]{1,16})|([0-9]{1,20}))", re.ASCII)
_NODE_FIRST = re.compile(r"\$NODEID(?:\s*\+\s*(\w+))?", re.IGNORECASE | re.ASCII)
_NODE_LAST = re.compile(r"(\w+)\s*\+\s*\$NODEID", re.IGNORECASE | re.ASCII)


class Remarks:
    """Tolerated errors of a file; `texts` name section, key and value."""

    def __init__(self) -> None:
        self.texts: list[str] = []
        self.omitted = 0
        """Remarks beyond the largest number that is kept."""

    def add(self, place: str, problem: str) -> None:
        """Note a problem at a place, as "[6040] DataType"."""
        text = f"{place}: {problem}" if place else problem
        if text in self.texts:
            return
        if len(self.texts) < _MOST_REMARKS:
            self.texts.append(text)
        else:
            self.omitted += 1


@dataclass
class Section:
    """One section: its name as written, and its keys, folded to lower case."""

    name: str
    keys: dict[str, str] = field(default_factory=dict)
    spelling: dict[str, str] = field(default_factory=dict)
    """The keys as written."""

    def get(self, key: str) -> str:
        """Return the value of a key in any spelling, "" where it is missing or empty."""
        return self.keys.get(key.lower(), "")

    def place(self, key: str = "") -> str:
        """Return how a message names this section, or a key in it."""
        return f"[{self.name}] {self.spelling.get(key, key)}".strip()

    def numbered(self) -> Iterator[tuple[str, str]]:
        """Yield the keys that are plain numbers, with their values."""
        yield from ((key, value) for key, value in self.keys.items() if key.isdecimal())


@dataclass(frozen=True)
class Number:
    """An integer of an EDS; `relative` ones count from the node id ($NODEID+0x180)."""

    value: int
    relative: bool = False


def integer(text: str) -> int | None:
    """Return a decimal, hexadecimal (0x) or octal (leading 0) integer, None for anything else."""
    match = _NUMBER.fullmatch(text.strip())
    if match is None:
        return None
    sign = -1 if match[1] else 1
    if match[2]:
        return sign * int(match[2], 16)
    digits = match[3]
    octal = len(digits) > 1 and digits[0] == "0" and not set(digits) & {"8", "9"}
    return sign * int(digits, 8 if octal else 10)


def number(text: str) -> Number | None:
    """Return an integer or a $NODEID expression, None for anything else."""
    text = text.strip()
    match = _NODE_FIRST.fullmatch(text) or _NODE_LAST.fullmatch(text)
    value = integer(text if match is None else match[1] or "0")
    return None if value is None else Number(value, match is not None)


def read_sections(path: Path, remarks: Remarks) -> dict[str, Section]:
    """Return the sections of a file by folded name; raises ProfileError for what is no EDS."""
    sections: dict[str, Section] = {}
    section = None
    for line_number, raw in enumerate(decoded_eds(path, remarks).splitlines(), 1):
        line = raw.strip()
        if not line or line[0] in ";#":
            continue
        if line[0] == "[":
            section = _begin(line, line_number, sections, remarks)
        elif section is None:
            remarks.add(f"line {line_number}", f"{value_text(line)} stands in no section; left out")
        else:
            _take(line, line_number, section, remarks)
    if not sections:
        raise ProfileError(
            path, "", "is no EDS or DCF: it has no section such as [DeviceInfo] or [1000]"
        )
    return sections


def decoded_eds(path: Path, remarks: Remarks) -> str:
    """Return the text of an EDS or DCF, as makers write them; raises ProfileError."""
    content = read_bytes(path, MOST_EDS_BYTES)
    for mark, encoding in (
        (codecs.BOM_UTF8, "utf-8"),
        (codecs.BOM_UTF16_LE, "utf-16-le"),
        (codecs.BOM_UTF16_BE, "utf-16-be"),
    ):
        if content.startswith(mark):
            remarks.add("", f"begins with the byte order mark of {encoding.upper()}")
            return content[len(mark) :].decode(encoding, errors="replace")
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError as error:
        remarks.add("", f"is not UTF-8 text (byte {error.start}); read as Windows-1252")
        return content.decode("cp1252", errors="replace")


def _begin(line: str, line_number: int, sections: dict[str, Section], remarks: Remarks) -> Section:
    """Return the section that a header begins; keys under a broken header are dropped."""
    match = _HEADER.fullmatch(line)
    if match is None or not match[1].strip():
        remarks.add(
            f"line {line_number}", f"{value_text(line)} is no section; left out with its keys"
        )
        return Section("")
    name = match[1].strip()
    if name.lower() in sections:
        remarks.add(f"[{name}]", "is there twice; of each key the first value counts")
    return sections.setdefault(name.lower(), Section(name))


def _take(line: str, line_number: int, section: Section, remarks: Remarks) -> None:
    key, equals, value = line.partition("=")
    key, value = key.strip(), _COMMENT.sub("", " " + value).strip()
    if not equals or not key:
        remarks.add(f"line {line_number}", f"{value_text(line)} is not KEY=VALUE; left out")
    elif key.lower() not in section.keys:
        section.keys[key.lower()] = value
        section.spelling[key.lower()] = key
    elif section.keys[key.lower()] != value:
        remarks.add(
            section.place(key), f"is there twice; the first value counts, not {value_text(value)}"
        )

"""The lines of a G-code file: codes and words, without comments and words that have no meaning
here.

All faults of a file are collected in `Findings`, so that they are reported together.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final

from cdpr_rt.motion.path_description import PathError

_WORD: Final = re.compile(r"\s*([A-Za-z])\s*((?:[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+))?)")
_EXPONENT: Final = re.compile(r"[eE][+-]?[0-9]")
_CODE: Final = re.compile(r"[GM]\s*[0-9]", re.IGNORECASE)
_FIRST_CODE: Final = re.compile(
    r"(?:[NT]\s*[0-9]+\s*)*M\s*0*([0-9]+)(?:(?<=862)\.[0-9])?(?![0-9.])", re.IGNORECASE
)
_MACRO: Final = re.compile(r"[A-Z_]{3,}[A-Z0-9_]*", re.IGNORECASE)
"""Pattern of a macro's name in the firmware of printers."""
_SETTING: Final = re.compile(r"\$[0-9]+\s*=")
_FULL_SPEED: Final = re.compile(r"S\s*100(\.0*)?(?![0-9.])", re.IGNORECASE)
_CHECKSUM: Final = re.compile(r"\*\s*[0-9]+\s*$")
_LINE_END: Final = re.compile(r"\r\n|\r|\n")
_PROGRAM_NUMBER: Final = re.compile(r"[O:]\s*[0-9]+$", re.IGNORECASE)
_QUERIES: Final = frozenset(("$", "$$", "$#", "$G", "$H", "$I", "$N", "$X", "?"))
"""Commands to grbl that do not move the machine, or move it only to its switches."""
_MOST_DIGITS: Final = 40
_LONGEST_NAME: Final = 60
_LARGEST_VALUE: Final = 1e9
_MOST_CHARS: Final = 4096
"""Largest length of a line."""
_MOST_LINES: Final = 1_000_000
"""Largest number of lines in a file."""
_MOST_TEXTS: Final = 20
_REPEATED: Final = frozenset("GM")

IDLE_LETTERS: Final = frozenset("STHDE")
_IDLE_CODES: Final = frozenset(
    ("G43", "M1", "M3", "M4", "M5", "M6", "M7", "M8", "M9", "M10", "M11", "M48", "M49")
)
"""Codes for tools, spindles and coolants, which may share a line with a motion."""
_ALONE: Final = frozenset(("M10", "M11", "M48", "M49"))
"""Codes of clamps and overrides. Other words in a line with such a code and without a G code are
not a motion."""
_OUTPUTS: Final = {
    **dict.fromkeys(("M62", "M63", "M64", "M65"), "P"), "M67": "Q", "M68": "Q",
}  # fmt: skip
"""Letter of the number or value of an output, which may share a line with a motion."""
_TEXTS: Final = frozenset(("M117", "M118"))
_IDLE_LINES: Final = _TEXTS | {
    f"M{number}"
    for number in (
        17, 18, 19, 20, 21, 27, 31, 42, *range(50, 54), *range(62, 66), 67, 68, 73, *range(75, 79),
        *range(80, 86), 92, *range(104, 117), 119, 140, 141, 150, 155, 190, 191, *range(200, 206),
        207, 208, 209, 211, 221, 240, 280, 300, 301, 302, 304, 355, 400, 401, 402, 412, 413, 420,
        486, *range(500, 505), 555, 566, 569, 572, 593, 701, 702, 851, 862, 900, 905, 906, 907, 913,
        914,
    )
}  # fmt: skip
"""Codes for printers (heaters, fans, displays), outputs, and limits of another machine."""
NEVER_IGNORED: Final = frozenset(("M2", "M30", "M97", "M98", "M99", "M206"))
"""Codes that end a file, call another file or move its zero."""
_WORDS_OF_MOTIONS: Final = frozenset("FGIJKLMNOPQR")


@dataclass(frozen=True)
class Block:
    """One line of a file: its number, its G and M codes, and its other words."""

    line: int
    codes: tuple[str, ...]
    """Codes such as G1, G20, M2, in their order in the line."""
    words: dict[str, float]
    """Values of the other words by letter, in the units of the file; nan for a letter without a
    number."""


@dataclass
class Findings:
    """Faults of a file, ignored parts, and notes for the user."""

    source: str
    problems: dict[str, list[int]] = field(default_factory=dict)
    """Lines by problem, in the order in which they were found."""
    ignored: dict[str, list[int]] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def refuse(self, line: int, problem: str) -> None:
        """Record that a line cannot be followed."""
        self.problems.setdefault(problem, []).append(line)

    def ignore(self, line: int, what: str) -> None:
        """Record that something in a line is ignored."""
        self.ignored.setdefault(what, []).append(line)

    def require_none(self) -> None:
        """Raise PathError with all problems, each with the first line that has it."""
        if not self.problems:
            return
        texts = [
            (lines[0], problem + (f" ({len(lines)} lines)" if len(lines) > 1 else ""))
            for problem, lines in self.problems.items()
        ]
        (line, text), *others = sorted(texts[:_MOST_TEXTS], key=lambda one: one[0])
        text += "".join(f"\n{self.source}:{number}: {other}" for number, other in others)
        if len(texts) > _MOST_TEXTS:
            text += f"\n{self.source}: and {len(texts) - _MOST_TEXTS} more problems"
        raise PathError(self.source, line, text)

    def notices(self) -> list[str]:
        """Return notes for the user, with all ignored parts in one text."""
        if not self.ignored:
            return self.notes
        listed = [
            f"{what} (line {lines[0]})" if len(lines) == 1 else f"{what} ({len(lines)} lines)"
            for what, lines in self.ignored.items()
        ]
        if len(listed) > _MOST_TEXTS:
            listed[_MOST_TEXTS:] = [f"{len(listed) - _MOST_TEXTS} more"]
        return [f"ignored: {', '.join(listed)}", *self.notes]


def require_ignorable(source: str, ignored: frozenset[str], axes: list[str]) -> None:
    """Raise PathError for a word or code that changes the meaning of other lines."""
    for name in sorted(ignored):
        if len(name) == 1 and (name in axes or name in _WORDS_OF_MOTIONS):
            raise PathError(source, 0, f"--ignore {name}: the path depends on it")
        if len(name) > 1 and name[0] not in "GM" and not _MACRO.fullmatch(name):
            raise PathError(source, 0, f"--ignore {name}: allowed: {name[0]}, without a number")
        is_code = name[0] == "G" and len(name) > 1 and not _MACRO.fullmatch(name)
        if name in NEVER_IGNORED or (is_code and name not in _IDLE_CODES):
            raise PathError(source, 0, f"--ignore {name}: other lines depend on it")


def blocks(text: str, findings: Findings, ignored: frozenset[str] = frozenset()) -> Iterator[Block]:
    """Yield the lines with content, up to the end of the program.

    `ignored` are letters that are dropped, and M codes and macros whose lines are skipped, in
    addition to those without meaning for a platform. Unreadable lines are recorded as problems, not
    yielded.
    """
    percents = 0
    for number, full in enumerate(_LINE_END.split(text.removeprefix("\ufeff")), 1):
        if number > _MOST_LINES:
            findings.refuse(number, f"the file has more than {_MOST_LINES} lines; divide it")
            return
        if len(full) > _MOST_CHARS:
            findings.refuse(number, f"the line is longer than {_MOST_CHARS} characters")
            continue
        line = _without_comments(full, number, findings)
        if line.startswith("%"):
            percents += 1
            if percents == 2:
                return
            continue
        if line.startswith("/"):
            line = line[1:].lstrip()
            findings.ignore(number, "/ (the line is followed)")
        block = _block(line, number, findings, ignored)
        if block is None:
            continue
        yield block
        if "M2" in block.codes or "M30" in block.codes:
            return
    findings.notes.append("the file ends without M2 or M30: is it complete?")


def _without_comments(line: str, number: int, findings: Findings) -> str:
    """Return a line without comments: ( ... ), which may be nested, and all after a semicolon."""
    kept, depth = [], 0
    for part in re.split(r"([();])", line):
        if part == "(":
            depth += 1
            kept.append(" ")
        elif part == ")" and depth:
            depth -= 1
        elif part == ";" and not depth:
            break
        elif not depth:
            kept.append(part)
    if depth:
        findings.refuse(number, "a comment is not closed; allowed: ( ... ) in one line")
        return ""
    return "".join(kept).strip()


def _block(line: str, number: int, findings: Findings, ignored: frozenset[str]) -> Block | None:
    """Return the content of a line; None for an empty line or one that cannot be read."""
    if line.upper() in _QUERIES:
        findings.ignore(number, line.upper())
    elif _SETTING.match(line):
        findings.ignore(number, "settings of grbl ($)")
    elif line and not _PROGRAM_NUMBER.match(line):
        if _CHECKSUM.search(line):
            findings.ignore(number, "checksums")
            line = _CHECKSUM.sub("", line).rstrip()
        if not line:
            return None
        if not _is_skipped(line, number, findings, ignored):
            if not (problem := _unreadable(line)):
                return _words(line, number, findings, ignored)
            findings.refuse(number, problem)
    return None


def _is_skipped(line: str, number: int, findings: Findings, ignored: frozenset[str]) -> bool:
    """Return whether the whole line is skipped, because of its first code or macro."""
    macro = _MACRO.match(line)
    if macro is not None and macro[0].upper() in ignored:
        findings.ignore(number, f"the line of {macro[0].upper()}")
        return True
    first = _FIRST_CODE.match(line)
    name = "" if first is None else f"M{int(first[1])}"
    if name in _TEXTS:
        findings.ignore(number, f"{name} with its text")
        return True
    if first is None or not _skips_line(name, line, ignored):
        return False
    if other := _CODE.search(line, first.end()):
        code = line[other.start() :].split(maxsplit=1)[0]
        findings.refuse(number, f"{name} and {code[:8]} are on one line; split it")
    else:
        findings.ignore(number, f"the line of {name}")
    return True


def _skips_line(name: str, line: str, ignored: frozenset[str]) -> bool:
    """Return whether an M code uses all words of its line, and has no meaning here."""
    if name == "M220":
        return name in ignored or _FULL_SPEED.search(line) is not None
    return name in _IDLE_LINES or (name in ignored and name not in _IDLE_CODES)


def _unreadable(line: str) -> str:
    """Return the reason why a line does not consist of words, or ""."""
    if "#" in line or "[" in line:
        return "parameters and expressions (#, [ ]) are not supported; allowed: numbers"
    if line[0] in "Oo":
        return "O-words (subroutines, branches, loops) are not supported; allowed: plain lines"
    if line[0] == "$":
        return f"{line[:20]}: a command to a controller, not G-code; remove it"
    if macro := _MACRO.match(line):
        name = macro[0][:_LONGEST_NAME].upper()
        advice = f"if it neither moves nor changes later lines, --ignore {name} skips its line"
        return f"{name}: a macro, not G-code; {advice}"
    return ""


def _words(line: str, number: int, findings: Findings, ignored: frozenset[str]) -> Block | None:
    codes: list[str] = []
    words: dict[str, float] = {}
    at, alone, of_output = 0, "", ""
    while at < len(line):
        match = _WORD.match(line, at)
        # a letter without a number, as in printers' G28 X Y
        bare = match is not None and not match[2] and "G28" not in codes
        if match is None or bare or len(match[2]) > _MOST_DIGITS:
            rest = line[at:].strip()
            findings.refuse(number, f"{rest[:20]!r}: allowed: words such as X12.5")
            return None
        at = match.end()
        letter = match[1].upper()
        if match[2] and _EXPONENT.match(line, at):
            whole = line[match.start() :].split(maxsplit=1)[0]
            findings.refuse(
                number,
                f"{whole[:20]}: a number must have no exponent; "
                "if E is a word, write a space before it",
            )
            return None
        value = float(match[2]) if match[2] else math.nan
        if abs(value) > _LARGEST_VALUE:
            findings.refuse(
                number, f"{letter}: the number is too large; allowed: up to {_LARGEST_VALUE:g}"
            )
            return None
        name = f"{letter}{value:g}"
        if letter == "N":
            continue
        seconds = letter == "S" and "G4" in codes
        output = letter == of_output
        output |= letter == "P" and bool(alone) and "G" not in line.upper()  # as in Mach3's M11 P1
        of_output = "" if letter == of_output else of_output
        if (letter in IDLE_LETTERS and not seconds) or letter in ignored or output:
            findings.ignore(number, letter)
        elif name in _IDLE_CODES or name in _OUTPUTS:
            findings.ignore(number, name)
            alone = name if name in _ALONE else alone
            of_output = _OUTPUTS.get(name, of_output)
        elif name in ignored or name in _IDLE_LINES:
            findings.refuse(number, f"{name} is on a line with other words; split it")
        elif letter in _REPEATED:
            codes.append(name)
        elif letter in words:
            findings.refuse(number, f"{letter} occurs twice in this line")
            return None
        else:
            words[letter] = value
    if alone and words.keys() - {"F"} and not any(code[0] == "G" for code in codes):
        findings.refuse(
            number, f"{alone}: {next(iter(words))} cannot be in its line; put it on a separate line"
        )
        return None
    return Block(number, tuple(codes), words)

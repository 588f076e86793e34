"""Whether several runs of a command have written the same.

Parts of a file that depend on the wall clock are left out."""

from __future__ import annotations

import hashlib
import json
import re
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path
from typing import Any, Final

from mcap.exceptions import McapError
from mcap.reader import make_reader

from cdpr_rt.service.recordings.recording_schema import TIMING
from cdpr_tools.repeat.run import FRAMES, Run

WALL_KEYS: Final = ("created", "date", "wall_s")
"""Keys of JSON and TOML files whose values are the time of day, or how long it took."""
NOT_COMPARED: Final = (".html", ".png", ".svg", ".pdf")
"""Ends of the names of pages and pictures, which are drawn from what is compared."""

Piece = tuple[str, bytes]
"""Where it stands in the file, and what stands there."""
_BLOCK_BYTES: Final = 1 << 16
_SHOWN: Final = 60
_DATES: Final = re.compile(r"(?<!\d)\d{8}(?:T\d{6}Z|-\d{6})(?!\d)")


class UnreadableError(Exception):
    """A file is not what the end of its name says."""


def normalised(text: str, run: Run) -> str:
    """Return a name without the run's folder, the time of day and ids of the run's processes."""
    text = _DATES.sub("DATE", text.replace(str(run.folder), "."))
    return re.sub(r"(?<=-)\d+(?!\d)", lambda m: "PID" if int(m[0]) in run.processes else m[0], text)


def pieces(path: Path, run: Run) -> Iterator[Piece]:
    """Yield the parts of a file that are compared; raises UnreadableError."""
    try:
        if path.suffix == ".mcap":
            yield from _messages(path)
        elif path.suffix == ".json":
            yield from _leaves("", json.loads(path.read_bytes()), run)
        elif path.suffix == ".toml":
            yield from _leaves("", tomllib.loads(path.read_text(encoding="utf-8")), run)
        elif path.name.startswith(Path(FRAMES).stem) and path.suffix == Path(FRAMES).suffix:
            with path.open("rb") as file:
                yield from ((f"line {k}", line) for k, line in enumerate(file, 1))
        else:
            with path.open("rb") as file:
                while block := file.read(_BLOCK_BYTES):
                    yield f"byte {file.tell() - len(block)}", block
    except (OSError, ValueError, McapError) as error:
        raise UnreadableError(str(error) or type(error).__name__) from error


def _messages(path: Path) -> Iterator[Piece]:
    """Yield the messages of each topic in the order of the file."""
    with path.open("rb") as file:
        reader = make_reader(file)
        summary = reader.get_summary()
        if summary is None:
            raise UnreadableError("the recording was not closed")
        topics = sorted({channel.topic for channel in summary.channels.values()} - {TIMING})
        for topic in topics:
            messages = reader.iter_messages(topics=[topic], log_time_order=False)
            for number, (_, _, message) in enumerate(messages, 1):
                yield f"{topic}, message {number}", message.data


def _leaves(where: str, value: Any, run: Run) -> Iterator[Piece]:
    if isinstance(value, dict):
        for key, one in value.items():
            if key not in WALL_KEYS:
                yield from _leaves(f"{where}.{key}" if where else key, one, run)
    elif isinstance(value, list):
        for number, one in enumerate(value):
            yield from _leaves(f"{where}[{number}]", one, run)
    else:
        yield where, (normalised(value, run) if isinstance(value, str) else repr(value)).encode()


def difference(one: Iterator[Piece], other: Iterator[Piece]) -> str:
    """Return the first difference for people, "" where there is none."""
    for a, b in zip_longest(one, other):
        if a != b:
            return _described(a, b)
    return ""


def _described(a: Piece | None, b: Piece | None) -> str:
    if a is None or b is None:
        ends, there = ("first", b) if a is None else ("second", a)
        assert there is not None  # one of the two goes on
        return f"{there[0]}: the {ends} has no more"
    if a[0] != b[0]:
        return f"{a[0]} in the one, {b[0]} in the other"
    if a[0].startswith("byte "):
        first = next(
            (k for k, (x, y) in enumerate(zip(a[1], b[1], strict=False)) if x != y),
            min(len(a[1]), len(b[1])),
        )
        return f"byte {int(a[0][5:]) + first}"
    if a[0].startswith("/") and (inner := _inner(a[1], b[1])):
        return f"{a[0]}: {inner}"
    return f"{a[0]}: {_shown(a[1])} | {_shown(b[1])}"


def _inner(a: bytes, b: bytes) -> str:
    """Return the first difference of two messages by its name."""
    no_run = Run(0, Path("/nowhere"), Path("/nowhere"), 0, 0.0, frozenset(), 0, 0.0)
    try:
        return difference(*(_leaves("", json.loads(text), no_run) for text in (a, b)))
    except ValueError:
        return ""


def _shown(text: bytes) -> str:
    shown = text.decode(errors="replace").strip()
    return shown if len(shown) <= _SHOWN else shown[:_SHOWN] + " ..."


@dataclass(frozen=True)
class Verdict:
    """What came out for one file."""

    file: str
    """Its name in its run's folder, without the time of day and ids of processes."""
    same: bool | None
    """Whether it is the same in all runs, None where it is not compared."""
    hashes: Sequence[str]
    """One for each run that has the file."""
    difference: str = ""
    """The first one, for people."""

    def line(self) -> str:
        """Return it as a line."""
        if self.same is None:
            return f"not compared              {self.file}"
        hashes = list(dict.fromkeys(self.hashes))
        if self.same:
            return f"same     {hashes[0]} {self.file}"
        return f"DIFFERS  {hashes[0]} {self.file}: {self.difference}"


def compare(runs: Sequence[Run]) -> list[Verdict]:
    """Return the verdict for each file that any of the runs has written."""
    files = [_files(run) for run in runs]
    names = sorted({name for some in files for name in some})
    return [_verdict(name, runs, [some.get(name) for some in files]) for name in names]


def _files(run: Run) -> dict[str, Path]:
    """Return the files of a run by what they are usually called."""
    found: dict[str, Path] = {}
    for path in sorted(one for one in run.folder.rglob("*") if one.is_file()):
        name = base = normalised(str(path.relative_to(run.folder)), run)
        number = 1
        while name in found:
            number += 1
            name = f"{base} ({number})"
        found[name] = path
    return found


def _verdict(name: str, runs: Sequence[Run], paths: Sequence[Path | None]) -> Verdict:
    if name.endswith(NOT_COMPARED):
        return Verdict(name, None, ())
    hashes: list[str] = []
    first: tuple[Path, Run] | None = None
    found = ""
    for run, path in zip(runs, paths, strict=True):
        if path is None:
            found = found or f"run {run.number} has not written it"
            continue
        try:
            hashes.append(_hash(path, run))
        except UnreadableError as error:
            hashes.append("unreadable  ")
            found = found or f"in run {run.number}: cannot be read: {error}"
            continue
        if first is None:
            first = path, run
        elif hashes[-1] != hashes[0] and not found:
            where = difference(pieces(*first), pieces(path, run))
            found = f"runs {first[1].number} and {run.number}: {where}"
    return Verdict(name, not found, hashes, found)


def _hash(path: Path, run: Run) -> str:
    sha = hashlib.sha256()
    for where, piece in pieces(path, run):
        sha.update(f"{where} {len(piece)} ".encode() + piece)
    return sha.hexdigest()[:16]

"""Whether several runs of a command have written the same."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cdpr_tools.repeat.contents import NOT_COMPARED, UnreadableError, difference, normalised, pieces
from cdpr_tools.repeat.run import Run


@dataclass(frozen=True)
class Verdict:
    """What came out for one file."""

    name: str
    """In its run's folder, without the time of day and ids of processes."""
    same: bool | None
    """Whether it is the same in all runs, None where it is not compared."""
    hashes: Sequence[str]
    """One for each run that has the file."""
    difference: str = ""
    """The first one, for people."""

    def line(self) -> str:
        """Return it as a line."""
        if self.same is None:
            return f"not compared              {self.name}"
        hashes = list(dict.fromkeys(self.hashes))
        if self.same:
            return f"same     {hashes[0]} {self.name}"
        return f"DIFFERS  {hashes[0]} {self.name}: {self.difference}"

    def as_dict(self) -> dict[str, Any]:
        """Return it for JSON."""
        return {
            "file": self.name,
            "same": self.same,
            "hashes": list(self.hashes),
            "difference": self.difference,
        }


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

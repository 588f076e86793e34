"""Which recordings are kept: a cap by age and one by size, so that no disk fills up unseen."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

BYTES_PER_AXIS: Final = 60.0
"""What an axis takes of a file in a cycle, about: more in motion, less at rest."""
_WRITTEN_S: Final = 60.0
"""A file that was written to within so long may be another daemon's, and stays."""
_DAY_S: Final = 86400.0


@dataclass(frozen=True)
class Retention:
    """What is kept of a robot's recordings; infinite: everything."""

    days: float = float("inf")
    total_bytes: float = float("inf")

    def prune(self, folder: Path, robot: str) -> list[Path]:
        """Remove recordings of this robot beyond the caps, the oldest first; return which.

        Only files that are named as its recordings are looked at. What cannot be removed stays.
        """
        found = sorted(_recordings(folder, robot), key=lambda one: one[1])
        now_s, total = time.time(), sum(size for _, _, size in found)
        removed = []
        for path, written_s, size in found:
            age_s = now_s - written_s
            if age_s < _WRITTEN_S or not (age_s > self.days * _DAY_S or total > self.total_bytes):
                continue
            with suppress(OSError):
                path.unlink()
                removed.append(path)
                total -= size
        return removed


def _recordings(folder: Path, robot: str) -> Iterator[tuple[Path, float, int]]:
    name = re.compile(re.escape(robot) + r"-\d{8}T\d{6}Z-\d{3,}\.mcap")
    for path in folder.glob("*.mcap"):
        if not name.fullmatch(path.name) or path.is_symlink():
            continue
        with suppress(OSError):
            told = path.stat()
            yield path, told.st_mtime, told.st_size


def size_text(count: float) -> str:
    """Return a number of bytes for people, in a unit that leaves it at least 1."""
    for unit, size in (("GB", 1e9), ("MB", 1e6), ("kB", 1e3)):
        if count >= size:
            return f"{count / size:.3g} {unit}"
    return f"{count:.0f} bytes"

"""Retention of recordings by age and size, so that they do not fill the disk."""

from __future__ import annotations

import re
import stat
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

BYTES_PER_AXIS: Final = 60.0
"""Approximate number of bytes per axis and cycle: more in motion, less at rest."""
_WRITTEN_S: Final = 60.0
"""A file that was written within this time may belong to another daemon, so it is kept."""
_DAY_S: Final = 86400.0
_GAP_DAYS: Final = 30.0


@dataclass(frozen=True)
class Retention:
    """Limits of the recordings that are kept for a robot; if they are infinite, all are kept."""

    days: float = float("inf")
    total_bytes: float = float("inf")

    def prune(self, folder: Path, robot: str) -> list[Path]:
        """Remove recordings of this robot beyond the limits, the oldest first; return them.

        Only files with the names of this robot's recordings are considered. The newest file stays,
        and so do files that cannot be removed. Ages are relative to the last recording. A gap
        longer than both `days` and 30 days counts as zero, so that the correction of a wrong clock
        removes nothing.
        """
        found = sorted(recordings_of(folder, robot), key=lambda one: one[1])
        total = sum(size for _, _, size in found)
        removed = []
        for (path, written_s, size), age_s in zip(found, self._ages(found), strict=True):
            if path == found[-1][0] or abs(time.time() - written_s) < _WRITTEN_S:
                continue
            if age_s <= self.days * _DAY_S and total <= self.total_bytes:
                continue
            with suppress(OSError):
                path.unlink()
                removed.append(path)
                total -= size
        return removed

    def _ages(self, found: list[tuple[Path, float, int]]) -> list[float]:
        """Return the age of each recording relative to the last one, s."""
        longest_s = max(self.days, _GAP_DAYS) * _DAY_S
        ages = [0.0] * len(found)
        for k in range(len(found) - 2, -1, -1):
            gap_s = found[k + 1][1] - found[k][1]
            ages[k] = ages[k + 1] + (gap_s if gap_s <= longest_s else 0.0)
        return ages


def recordings_of(folder: Path, robot: str) -> Iterator[tuple[Path, float, int]]:
    """Yield path, time of the last write and size of each recording of a robot."""
    name = re.compile(re.escape(robot) + r"-\d{8}T\d{6}Z-\d{3,}\.mcap")
    for path in folder.glob("*.mcap"):
        with suppress(OSError):
            entry = path.lstat()
            if name.fullmatch(path.name) and stat.S_ISREG(entry.st_mode):
                yield path, entry.st_mtime, entry.st_size


def size_text(count: float) -> str:
    """Return a number of bytes as text, in the largest unit with a value of at least 1."""
    for unit, size in (("GB", 1e9), ("MB", 1e6), ("kB", 1e3)):
        if count >= size:
            return f"{count / size:.3g} {unit}"
    return f"{count:.0f} bytes"

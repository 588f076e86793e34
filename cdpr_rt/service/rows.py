"""Content of a block as plain JSON: its newest row and its texts; and the time of day."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Mapping
from typing import Any, Final

from cdpr_rt.core.cycle_row import AXIS_FIELDS, FIELDS, SCALARS, Row
from cdpr_rt.core.shared_block import SharedBlock, SharedBlockError

LABELS: Final = {
    field.name: {label.value: label.label for label in field.labels}
    for field in FIELDS.values()
    if field.labels is not None
}
"""For fields that contain numbers of states and the like: the names of these numbers."""
_STATUS_FIELDS: Final = (*SCALARS, "pose")
_AXIS_FIELDS: Final = tuple(field.name for field in AXIS_FIELDS if field.status)
_DESCRIBED: Final = ("name", "bus", "node_id", "winch", "commissioned")


def newest_row(block: SharedBlock) -> Row | None:
    """Return a copy of the newest row, None before the first."""
    for _ in range(100):
        written = int(block.counters["rows"][0])
        if written == 0:
            return None
        row: Row = block.rows[(written - 1) % block.capacity].copy()
        if int(block.counters["rows"][0]) - written < block.capacity - 1:
            return row
    return None


def plain(value: Any) -> Any:
    """Return `value` for strict JSON: values that are not finite become null."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    return value


def row_table(row: Row, fields: Iterable[str] = FIELDS) -> dict[str, Any]:
    """Return the fields of one row, with arrays as lists and states as names."""
    table = {name: plain(row[name].tolist()) for name in fields}
    for name in LABELS.keys() & table.keys():
        table[name] = LABELS[name].get(table[name], "unknown")
    return table


def cycle_figures(block: SharedBlock, description: Mapping[str, Any]) -> dict[str, Any]:
    """Return `cycle` and `axes` of a status: common values of the newest row, and values per
    axis.
    """
    row = newest_row(block)
    described = description.get("axes") or [{} for _ in range(block.n)]
    axes = [{key: axis.get(key) for key in _DESCRIBED} for axis in described]
    if row is None:
        return {"cycle": None, "axes": axes}
    table = row_table(row, _AXIS_FIELDS)
    for number, axis in enumerate(axes[: block.n]):
        axis |= {name: table[name][number] for name in _AXIS_FIELDS}
    return {"cycle": row_table(row, _STATUS_FIELDS), "axes": axes[: block.n]}


class PublishedText:
    """The last `description` or `status` that was read from a loop's block."""

    def __init__(self, block: SharedBlock, name: str) -> None:
        self._version = block.counters[name]
        self._read = block.description if name == "description" else block.status
        self._seen = 0
        self.value: dict[str, Any] = {}

    def update(self) -> bool:
        """Read the text if it has changed; return whether it has changed."""
        version = int(self._version[0])
        if version == self._seen:
            return False
        try:
            self.value = plain(self._read())
        except (SharedBlockError, ValueError):  # the writer ended while it wrote the text
            return False
        self._seen = version
        return True


class WallClock:
    """Converts CLOCK_MONOTONIC into the time of day.

    Both clocks are compared only once, so later changes of the system clock have no effect.
    """

    def __init__(self, block: SharedBlock) -> None:
        self.start_ns = int(block.counters["start_realtime_ns"][0]) or time.time_ns()
        """The time of day at the beginning of the session."""
        monotonic_ns = int(block.counters["start_monotonic_ns"][0]) or time.monotonic_ns()
        self.start_monotonic_ns = monotonic_ns
        self.offset_ns = self.start_ns - monotonic_ns

    def __call__(self, stamp_ns: int) -> int:
        """Return the time of day in ns since 1970."""
        return stamp_ns + self.offset_ns

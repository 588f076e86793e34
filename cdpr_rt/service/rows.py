"""A cycle's row as plain JSON."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, Final

from cdpr_rt.core.cycle_row import FIELDS, Row
from cdpr_rt.core.shared_block import SharedBlock

LABELS: Final = {
    field.name: {label.value: label.label for label in field.labels}
    for field in FIELDS.values()
    if field.labels is not None
}
"""Names of the numbers of some fields."""


def newest_row(block: SharedBlock) -> Row | None:
    """Return a copy of the row written last, None before the first."""
    for _ in range(100):
        written = int(block.counters["rows"][0])
        if written == 0:
            return None
        row: Row = block.rows[(written - 1) % block.capacity].copy()
        if int(block.counters["rows"][0]) - written < block.capacity - 1:
            return row
    return None


def plain(value: Any) -> Any:
    """Return `value` as strict JSON has it: what is not finite becomes null."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    return value


def row_table(row: Row, fields: Iterable[str] = FIELDS) -> dict[str, Any]:
    """Return the fields of one row; arrays become lists, numbers what they stand for."""
    table = {name: plain(row[name].tolist()) for name in fields}
    for name in LABELS.keys() & table.keys():
        table[name] = LABELS[name].get(table[name], "unknown")
    return table

"""A cycle's row as plain JSON."""

from __future__ import annotations

import math
from typing import Any, Final

from cdpr_rt.runtime.cycle_row import AXES, POSES, SCALARS, Row
from cdpr_rt.runtime.shared_block import SharedBlock
from cdpr_rt.runtime.states import LoopState, Reaction

FIELDS: Final = (*SCALARS, *AXES, *POSES)
_STATES: Final = {state.value: state.label for state in LoopState}
_REACTIONS: Final = {reaction.value: reaction.label for reaction in Reaction}


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


def row_table(row: Row, fields: tuple[str, ...] = FIELDS) -> dict[str, Any]:
    """Return the fields of one row; arrays become lists, states and reactions their names."""
    table = {name: plain(row[name].tolist()) for name in fields}
    if "state" in table:
        table["state"] = _STATES.get(table["state"], "unknown")
    if "reaction" in table:
        table["reaction"] = _REACTIONS.get(table["reaction"], "unknown")
    return table

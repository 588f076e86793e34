"""JSON schema of each topic of a recording."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from cdpr_rt.core.cycle_row import FIELDS, WALL_TIMES, cycle_dtype

CYCLE, TIMING, STATUS, DESCRIPTION, EVENTS = (
    "/cycle", "/timing", "/status", "/description", "/events"
)  # fmt: skip
CYCLE_FIELDS: Final = tuple(name for name in FIELDS if name not in WALL_TIMES)
TIMING_FIELDS: Final = ("cycle", *WALL_TIMES)

_TYPES = {"f": "number", "i": "integer", "u": "integer", "b": "boolean"}
_KNOWN_OR_NOT = {"type": ["number", "null"]}


def cycle_schema(n: int) -> dict[str, Any]:
    """Return the schema of a row for n axes, without fields by wall-clock time."""
    about = "One cycle of the control loop; arrays over the axes, in SI units"
    return _row_schema("Cycle", about, CYCLE_FIELDS, n)


def timing_schema() -> dict[str, Any]:
    """Return the schema of a row's fields by wall-clock time."""
    about = "When a cycle of the control loop ran, and how long it took, by wall-clock time"
    return _row_schema("Timing", about, TIMING_FIELDS, 1)


def _row_schema(title: str, about: str, names: Sequence[str], n: int) -> dict[str, Any]:
    """Return the schema of the fields `names` of a row for n axes.

    Numbers may be null, which viewers do not expect of a schema: they read the plain `type` beside
    `$ref`, which a validator of this draft has to ignore.
    """
    dtype = cycle_dtype(n)
    properties: dict[str, Any] = {}
    for name in names:
        one: dict[str, Any] = {"type": _TYPES[dtype[name].base.kind]}
        if one["type"] == "number":
            one["$ref"] = "#/definitions/known_or_not"
        shape = dtype[name].shape
        if shape:
            one = {"type": "array", "items": one, "minItems": shape[0], "maxItems": shape[0]}
        properties[name] = {**one, "description": FIELDS[name].meaning}
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": f"cdpr_rt.{title}",
        "description": about,
        "type": "object",
        "definitions": {"known_or_not": _KNOWN_OR_NOT},
        "properties": properties,
        "required": list(properties),
        "additionalProperties": False,
    }


def _text_schema(title: str, description: str, **properties: str) -> dict[str, Any]:
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": f"cdpr_rt.{title}",
        "description": description,
        "type": "object",
        "properties": {name: {"type": kind} for name, kind in properties.items()},
    }


STATUS_SCHEMA: Final = _text_schema(
    "Status",
    "State, program, reasons and notices of the loop, each time one of them changed",
    state="string",
    program="string",
    reason="string",
    read_only="boolean",
    lockstep="boolean",
)
DESCRIPTION_SCHEMA: Final = _text_schema(
    "Description",
    "The robot, its axes, limits and programs, as they were while this file was recorded",
    robot="string",
    period_s="number",
    version="string",
)
EVENT_SCHEMA: Final = _text_schema(
    "Event",
    "A change of state, program or reaction as seen in the rows, or a remark of the service",
    text="string",
    cycle="integer",
    time_s="number",
)

"""What a recording's messages hold: one JSON schema for each topic."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from cdpr_rt.limits import Limit
from cdpr_rt.runtime.cycle_row import FIELDS, WALL_TIMES, cycle_dtype
from cdpr_rt.runtime.states import LoopState, Reaction

CYCLE, TIMING, STATUS, DESCRIPTION, EVENTS = (
    "/cycle", "/timing", "/status", "/description", "/events"
)  # fmt: skip
CYCLE_FIELDS: Final = tuple(name for name in FIELDS if name not in WALL_TIMES)
TIMING_FIELDS: Final = ("cycle", *WALL_TIMES)

_STATES = ", ".join(f"{state.value} {state.label}" for state in LoopState)
_REACTIONS = ", ".join(f"{reaction.value} {reaction.label}" for reaction in Reaction)
_LIMITS = ", ".join(f"{limit.value} {limit.key}" for limit in Limit)
_SEVEN = "x, y, z in m and quaternion w, x, y, z; null where it is not known"

MEANING: Final = {
    "cycle": "SYNCs since cycles began",
    "time_s": "bus time of the SYNC",
    "stamp_ns": "CLOCK_MONOTONIC when the loop woke for it",
    "lateness_s": "wake-up behind its deadline; 0 in lockstep",
    "exchange_s": "from SYNC until the last answer, or until it was given up",
    "compute_s": "from the last answer until the last command had been sent",
    "missed": "answers that did not come in time, over all axes, since the beginning",
    "late_cycles": "cycles that began more than a tenth of a period late, since the beginning",
    "stream_age_s": "age of the newest sample of the set-point stream; null without",
    "stream_buttons": "buttons of the sample that is played: bit 0 the clutch, "
    "bits 8 to 15 the number of the confirmation",
    "state": f"state of the loop: {_STATES}",
    "program": "number of the program in the description's list",
    "reaction": f"reaction of the supervisor in this cycle: {_REACTIONS}",
    "limit": f"the limit that caused it: {_LIMITS}",
    "limit_axis": "the axis concerned, -1 without",
    "answered": "axes that answered this SYNC",
    "setpoint_rad": "where the motor should be",
    "setpoint_velocity_rad_s": "how fast the set-point moves",
    "position_rad": "motor angle as the encoder gives it",
    "velocity_rad_s": "motor speed, estimated",
    "torque_actual_Nm": "torque that the drive reports",
    "torque_asked_Nm": "torque that the controller wanted, before limits",
    "torque_sent_Nm": "torque that was sent",
    "effort_Nm": "the controller's part of it",
    "compensation_Nm": "the compensation's part of it",
    "tension_N": "cable tension, measured or estimated; null where neither",
    "cable_length_m": "length of the cable; null where it is not known",
    "index_rad": "motor angle of the encoder's index, where it is known",
    "statusword": "CiA 402 statusword (6041h)",
    "valid": "whether the drive answered this SYNC",
    "alive": "whether its heartbeats come",
    "rate_ok": "whether its answers come at their rate",
    "index_known": "whether the encoder's index has been found",
    "tension_measured": "whether the tension is a sensor's",
    "pose": f"the platform's pose: {_SEVEN}",
    "pose_setpoint": f"where the platform should be: {_SEVEN}",
}
"""What each field of a row means; its unit is in its name."""

_TYPES = {"f": "number", "i": "integer", "u": "integer", "b": "boolean"}
_KNOWN_OR_NOT = {"type": ["number", "null"]}


def cycle_schema(n: int) -> dict[str, Any]:
    """Return the schema of a row for n axes, without what the wall's time is in."""
    about = "One cycle of the control loop; arrays over the axes, in SI units"
    return _row_schema("Cycle", about, CYCLE_FIELDS, n)


def timing_schema() -> dict[str, Any]:
    """Return the schema of what the wall's time is in, of one row."""
    about = "When a cycle of the control loop ran, and how long it took, by the wall's time"
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
        properties[name] = {**one, "description": MEANING[name]}
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

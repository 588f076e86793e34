"""What the control interface takes and gives, as JSON."""

from __future__ import annotations

import math
from typing import Annotated, Any, Final

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from cdpr_rt.service.lease import LONGEST_S, SHORTEST_S

_DEEPEST, _LONGEST_LIST, _LONGEST_TEXT = 4, 64, 200
_LARGEST: Final = 1e9


def _check_value(value: Any, depth: int = 0) -> None:
    """Raise ValueError for what no program can want."""
    if depth > _DEEPEST:
        raise ValueError(f"tables and lists within each other; allowed: {_DEEPEST} deep")
    if isinstance(value, str):
        if len(value) > _LONGEST_TEXT or not value.isprintable():
            raise ValueError(f"text; allowed: {_LONGEST_TEXT} printable characters")
    elif isinstance(value, int | float):
        if not math.isfinite(value) or abs(value) > _LARGEST:
            raise ValueError(f"number; allowed: finite, at most {_LARGEST:g} in size")
    elif isinstance(value, list | dict):
        if len(value) > _LONGEST_LIST:
            raise ValueError(f"{len(value)} items; allowed: {_LONGEST_LIST}")
        if isinstance(value, dict):
            for key in value:
                _check_value(key, depth + 1)
        for item in value.values() if isinstance(value, dict) else value:
            _check_value(item, depth + 1)


def _checked(value: dict[str, Any]) -> dict[str, Any]:
    _check_value(value)
    return value


_Name = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_-]{0,31}$", description="A program's name.")]
_Client = Annotated[
    str,
    Field(
        pattern=r"^[ -~]{1,64}$",
        description="Who asks, as others see it: 1 to 64 characters of printable ASCII.",
        examples=["maria@laptop"],
    ),
]
_Wanted = Annotated[
    dict[str, Any],
    AfterValidator(_checked),
    Field(description="What the program is to do; its page tells which keys it knows."),
]


class _Body(BaseModel):
    model_config = ConfigDict(extra="forbid")


class Who(_Body):
    """Who asks, for the record of events; the whole body may be left out."""

    client: _Client = "somebody"


class TakeControl(_Body):
    """Who wants to move, and how long it may be silent."""

    client: _Client
    ttl_s: Annotated[
        float,
        Field(ge=SHORTEST_S, le=LONGEST_S, description="Without a sign of life this long: hold."),
    ] = 2.0


class Enable(Who):
    """What runs from the first moment with power."""

    program: _Name = "hold"
    wanted: _Wanted = {}


class Program(Who):
    """What is to run from now on."""

    program: _Name
    wanted: _Wanted = {}


class Set(Who):
    """What the running program is to do now."""

    wanted: _Wanted


class _Answer(BaseModel):
    model_config = ConfigDict(extra="allow")


class Error(_Answer):
    """Why something was refused or failed."""

    error: str
    state: str | None = None
    """The loop's state, where it was the loop that refused."""


class Done(_Answer):
    """The loop has done it."""

    text: str
    state: str


class Held(_Answer):
    """The right to move, for whoever shows the token."""

    token: str
    ttl_s: float


class Renewed(_Answer):
    """The right to move goes on."""

    ttl_s: float


class Control(_Answer):
    """Who holds the right to move."""

    held: bool
    client: str | None
    left_s: float


class LoopLife(_Answer):
    """The loop's process."""

    pid: int
    alive: bool
    silent_s: float
    """How long ago it turned last."""


class Status(_Answer):
    """Everything at a glance."""

    robot: str
    state: str
    """unconfigured, inactive, ready, active, fault; starting, dead."""
    program: str | None
    reason: str
    """Why it left active, holds, or is not ready; stays until acknowledged or enabled again."""
    reason_limit: dict[str, Any] | None
    read_only: bool
    lockstep: bool
    notices: list[str]
    loop: LoopLife
    control: Control
    cycle: dict[str, Any] | None
    """Figures of the newest cycle, null before the first."""
    axes: list[dict[str, Any]]
    parts: dict[str, dict[str, Any]]
    """Recorder, live view, set-point stream and the service's own figures."""


class Event(_Answer):
    """Something that happened."""

    number: int
    time: str
    """Date and time, UTC."""
    kind: str
    text: str
    times: int
    """How often it happened in a row."""
    detail: dict[str, Any]


class Events(_Answer):
    """The last events, oldest first."""

    events: list[Event]

"""Refusals of a daemon's loop, reported with the names and units that the user typed."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Final, Self

from cdpr_rt.refusal import CommandRefusal, RefusalCode
from cdpr_tools.errors import BadInputError, WorkFailedError

_DEG, _MM = math.degrees(1.0), 1e3
_KEYS: Final = {
    "velocity_rad_s": (_DEG, "deg/s", ""),
    "cable_velocity_m_s": (_MM, "mm/s", ""),
    "position_rad": (_DEG, "deg", ""),
    "distance_rad": (_DEG, "deg", ""),
    "cable_m": (_MM, "mm", ""),
    "speed_rad_s": (_DEG, "deg/s", "--speed"),
    "speed_m_s": (_MM, "mm/s", "--speed"),
    "duration_s": (1.0, "s", "--seconds"),
    "back_m": (_MM, "mm", "path back"),
}
"""Factor and unit of the command line, and the option, if any, by the key of a program."""
# what to do in a state in which a command was refused
_REMEDIES: Final = {
    "unconfigured": "`cdpr status` gives the reason, `cdpr check` tries again",
    "inactive": "`cdpr status` gives the reason, `cdpr check` tries again",
    "ready": "`cdpr enable` switches the power on",
    "fault": "`cdpr status` gives the reason, `cdpr ack` acknowledges it",
}


class DaemonRefusalError(WorkFailedError):
    """The loop has refused a command; `refusal` has the code, None if there is only text."""

    def __init__(self, text: str, refusal: CommandRefusal | None = None) -> None:
        super().__init__(text)  # the only argument: pickle and type(error)(text) need no other
        self.refusal = refusal

    @classmethod
    def of(cls, refusal: CommandRefusal, text: str = "") -> Self:
        """Return the error of a refusal: `text`, or its own text by default, and the remedy."""
        return cls((text or str(refusal)) + _remedy(refusal), refusal)


def _remedy(refusal: CommandRefusal) -> str:
    """Return the remedy of a refusal, to be appended to it; "" if it is unknown."""
    if refusal.code is not RefusalCode.NOT_IN_STATE:
        return ""
    state, allowed = refusal.arguments["state"], list(refusal.arguments["allowed"])
    if state not in _REMEDIES or (state == "ready" and allowed != ["active"]):
        return ""
    return f"; {_REMEDIES[state]}"


@contextmanager
def in_typed_words(
    command: str, asked: str = "", axes: Sequence[str] = (), **words: str
) -> Iterator[None]:
    """Raise refusals in the block in terms of the typed `command`, or of the options in `asked`.

    `axes` are the names of the axes; `words` replace arguments of the refusal. A number out of
    bounds or a target outside the workspace is raised as BadInputError.
    """
    try:
        yield
    except DaemonRefusalError as error:
        refusal = error.refusal
        if refusal is None:
            raise
        if refusal.code is RefusalCode.OUT_OF_RANGE:
            if _KEYS.keys().isdisjoint(refusal.asked):
                raise
            raise BadInputError(_out_of_range(refusal, axes)) from None
        if enter_m := refusal.arguments.get("enter_m"):
            words["enter"] = f"`cdpr move --to {' '.join(f'{_MM * x:.6g}' for x in enter_m)}`"
        typed = asked if refusal.asked and asked else command
        text = f"{typed}: {refusal.reason(**words)}"
        if refusal.arguments.get("outside"):
            raise BadInputError(text) from None
        worded = DaemonRefusalError.of(refusal, text)
        for note in getattr(error, "__notes__", ()):
            worded.add_note(note)
        raise worded from None


def _out_of_range(refusal: CommandRefusal, axes: Sequence[str]) -> str:
    (key, value), index = next(iter(refusal.asked.items())), refusal.arguments.get("index")
    factor, unit, option = _KEYS[key]
    low, high = (float(f"{factor * refusal.arguments[end]:.4g}") for end in ("low", "high"))
    typed = f"{option} " if index is None else f"{axes[index]}="
    allowed = refusal.reason(low=low, high=high, unit=f" {unit}")
    return f"{typed}{factor * value:.6g}: {allowed}"

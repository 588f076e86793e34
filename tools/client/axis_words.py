"""Refusals of a daemon about single axes, in the units and words of the command line."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from typing import Final, TypeVar

from cdpr_tools.errors import BadInputError, WorkFailedError

_T = TypeVar("_T")
_DEG, _MM = math.degrees(1.0), 1e3
_KEYS: Final = {
    "velocity_rad_s": (_DEG, "deg/s", ""),
    "cable_velocity_m_s": (_MM, "mm/s", ""),
    "position_rad": (_DEG, "deg", ""),
    "distance_rad": (_DEG, "deg", ""),
    "cable_m": (_MM, "mm", ""),
    "speed_rad_s": (_DEG, "deg/s", "--speed"),
    "duration_s": (1.0, "s", "--seconds"),
}
"""By the key of a program: factor and unit of the command line, and the option, if it is one."""
_REFUSED: Final = re.compile(
    r"\w+: (?P<key>\w+)(?:\[(?P<axis>\d+)\])?: value (?P<value>\S+); "
    r"allowed: a number from (?P<low>\S+) to (?P<high>\S+)"
)


def typed_refusal(message: str, names: Sequence[str]) -> str:
    """Return a refusal with the name of the axis, or the option, and what is allowed as typed."""
    found = _REFUSED.fullmatch(message)
    if found is None or found["key"] not in _KEYS:
        return message
    factor, unit, option = _KEYS[found["key"]]
    value, low, high = (factor * float(found[name]) for name in ("value", "low", "high"))
    what = f"{option} {value:.6g}" if found["axis"] is None else _of_axis(found, names, value)
    return f"{what}: allowed: {low:.4g} to {high:.4g} {unit}"


def _of_axis(found: re.Match[str], names: Sequence[str], value: float) -> str:
    return f"{names[int(found['axis'])]}={value:.6g}"


def in_typed_words(do: Callable[[], _T], names: Sequence[str]) -> _T:
    """Return what `do` does; its refusal is raised as bad input, in the words that were typed."""
    try:
        return do()
    except (BadInputError, WorkFailedError) as error:
        refusal = typed_refusal(str(error), names)
        if refusal == str(error):
            raise
        raise BadInputError(refusal) from None

"""Why a command was refused: a code and its arguments for programs, text for people."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from enum import StrEnum
from typing import Any, Final

_SHOWN = 60
_PLACE_UNITS: Final = {
    "position_m": (1e3, "mm"),
    "distance_m": (1e3, "mm"),
    "rotation_rad": (math.degrees(1.0), "deg"),
    "turn_rad": (math.degrees(1.0), "deg"),
}


class RefusalCode(StrEnum):
    """Reason of a refusal; the arguments of each, besides the refused values, are in brackets."""

    NOT_IN_STATE = "not_in_state"
    """The loop's state does not allow the command (`state`, `allowed`: names of states)."""
    OUT_OF_RANGE = "out_of_range"
    """A number is out of its bounds (`index` in a list or None, `low`, `high`)."""
    NOT_FEASIBLE = "not_feasible"
    """The platform cannot hold a position, or cannot get there in a straight line (`why`; `outside`
    its workspace, then also `why_si`, in m and rad; `enter_m`: the nearest place of the workspace,
    if the platform is outside)."""
    NOTHING_LEFT = "nothing_left"
    """There is nothing to continue (`left`: target or path, `instead`: the alternative)."""
    NOT_TIGHT = "not_tight"
    """The cables are not tight."""
    NOT_CALIBRATED = "not_calibrated"
    """The platform's geometry is not known well enough to move it (`why`)."""
    BAD_SOURCE = "bad_source"
    """The source of cable lengths cannot be used (`why`, `allowed`: sources, perhaps none)."""


@dataclass(frozen=True)
class CommandRefusal:
    """Why a command was refused, for programs; `str` gives the text for people.

    The loop raises an error with a refusal instead of a text; the reply then contains the refusal.
    """

    code: RefusalCode
    command: str
    """The command, or the program that it was for."""
    asked: Mapping[str, Any] = field(default_factory=dict)
    """The refused keys and their values; empty if the reason is not in the arguments."""
    arguments: Mapping[str, Any] = field(default_factory=dict)

    def __str__(self) -> str:
        if self.code is RefusalCode.OUT_OF_RANGE:
            return f"{self.command}: {self._keys()}; {self.reason(numbers='a number from ')}"
        return self._text()

    def in_si(self) -> str:
        """Return the text with places in m and rad, for the reader of a script."""
        why_si = self.arguments.get("why_si")
        return str(self) if why_si is None else self._text(units={}, why=why_si)

    def _text(self, units: Mapping[str, tuple[float, str]] = _PLACE_UNITS, **others: Any) -> str:
        parts = (self.command, self._keys(units), self.reason(option="from ", **others))
        return ": ".join(part for part in parts if part)

    def reason(self, **others: Any) -> str:
        """Return the reason as text; `others` replace arguments of the same name."""
        arguments = {"numbers": "", "unit": "", "option": "", **self.arguments, **others}
        match self.code:
            case RefusalCode.NOT_IN_STATE:
                allowed = " or ".join(arguments["allowed"])
                return f"not allowed in state {arguments['state']}; allowed in {allowed}"
            case RefusalCode.OUT_OF_RANGE:
                return "allowed: {numbers}{low:g} to {high:g}{unit}".format(**arguments)
            case RefusalCode.NOTHING_LEFT:
                return "there is no {left} to continue; allowed: {instead}".format(**arguments)
            case RefusalCode.NOT_TIGHT:
                return "the cables are not tight; run tighten first"
            case RefusalCode.BAD_SOURCE if arguments["allowed"]:
                sources = ", ".join(arguments["allowed"])
                return f"{arguments['why']}; allowed: {arguments['option']}{sources}"
        enter = arguments.get("enter") or f"position_m {arguments.get('enter_m')}"
        entering = (
            f"; the platform is not in it yet: first {enter}" if "enter_m" in arguments else ""
        )
        return f"{arguments['why']}{entering}"

    def _keys(self, units: Mapping[str, tuple[float, str]] = _PLACE_UNITS) -> str:
        index = self.arguments.get("index")
        place = "" if index is None else f"[{index}]"
        return ", ".join(
            key if value is True else f"{key}{place}: value {_in_units(units, key, value)}"
            for key, value in self.asked.items()
        )

    def as_json(self) -> dict[str, Any]:
        """Return the refusal as JSON, as it appears in the daemon's answers."""
        return asdict(self)

    @classmethod
    def from_json(cls, value: Any) -> CommandRefusal | None:
        """Return the refusal in an answer; None if the answer is no refusal."""
        try:
            refusal = cls(**{**value, "code": RefusalCode(value["code"])})
        except (TypeError, KeyError, ValueError):
            return None
        return refusal if refusal._is_sound() else None

    def _is_sound(self) -> bool:
        """Return whether all members have valid types and no argument of the code is missing.

        Further arguments, for example from a newer daemon, do not matter.
        """
        asked, arguments = self.asked, self.arguments
        if not (
            isinstance(self.command, str)
            and isinstance(asked, dict)
            and isinstance(arguments, dict)
        ):
            return False
        if self.code is RefusalCode.OUT_OF_RANGE and not all(map(_is_number, asked.values())):
            return False
        return all(is_sound(arguments.get(key)) for key, is_sound in _ARGUMENTS[self.code].items())


def _in_units(units: Mapping[str, tuple[float, str]], key: str, value: Any) -> str:
    """Return a value as text; positions are converted to the units of their keys."""
    if key not in units or not isinstance(value, list) or not all(map(_is_number, value)):
        return shown(value)
    factor, unit = units[key]
    return f"{shown([round(factor * x, 1) + 0.0 for x in value])} {unit}"


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _is_index(value: Any) -> bool:
    return value is None or (type(value) is int and value >= 0)


def _is_text(value: Any) -> bool:
    return isinstance(value, str)


def _are_texts(value: Any) -> bool:
    return isinstance(value, list) and all(map(_is_text, value))


_ARGUMENTS: Final[Mapping[RefusalCode, Mapping[str, Callable[[Any], bool]]]] = {
    RefusalCode.NOT_IN_STATE: {"state": _is_text, "allowed": _are_texts},
    RefusalCode.OUT_OF_RANGE: {"index": _is_index, "low": _is_number, "high": _is_number},
    RefusalCode.NOT_FEASIBLE: {"why": _is_text},
    RefusalCode.NOTHING_LEFT: {"left": _is_text, "instead": _is_text},
    RefusalCode.NOT_TIGHT: {},
    RefusalCode.NOT_CALIBRATED: {"why": _is_text},
    RefusalCode.BAD_SOURCE: {"why": _is_text, "allowed": _are_texts},
}
"""The arguments of each code, with a function that checks each of them."""


def shown(value: Any) -> str:
    """Return a value as text, shortened if it is long."""
    text = repr(value)
    return text if len(text) <= _SHOWN else f"{text[:_SHOWN]} ..."


def refusal_of(error: Exception) -> CommandRefusal | None:
    """Return the refusal in an error of the loop; None if the error has only a text."""
    first = error.args[0] if error.args else None
    return first if isinstance(first, CommandRefusal) else None

"""Arguments of a command to a program: typed, bounded, refused with a message."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.errors import ControlError
from cdpr_rt.refusal import CommandRefusal, RefusalCode, shown


class ProgramError(ControlError):
    """A command that a program refuses; the message names the key and value."""


class CommandArguments:
    """The keys and values that came with a command; raises ProgramError for keys not `allowed`."""

    def __init__(self, program: str, arguments: Mapping[str, Any], allowed: Sequence[str]) -> None:
        self._program = program
        self._arguments = arguments
        for key in arguments:
            if key not in allowed:
                words = ", ".join(allowed) if allowed else "none: it takes no set-point"
                raise ProgramError(f"{program}: key {shown(key)}; allowed: {words}")

    def __contains__(self, key: str) -> bool:
        return key in self._arguments

    def one_of(self, *keys: str) -> str:
        """Return which one of the keys was given; raises ProgramError for none or several."""
        given = [key for key in keys if key in self._arguments]
        if len(given) != 1:
            found = " and ".join(given) if given else "none of them"
            raise ProgramError(f"{self._program}: {found}; allowed: one of {', '.join(keys)}")
        return given[0]

    def number(self, key: str, low: float, high: float, default: float) -> float:
        """Return a number from `low` to `high`, the default where none was given."""
        value = self._arguments.get(key, default)
        return self._checked(key, None, value, low, high)

    def whole(self, key: str, low: int, high: int, default: int) -> int:
        """Return a whole number from `low` to `high`, the default where none was given."""
        value = self.number(key, low, high, default)
        if value != round(value):
            raise self._refused(key, value, f"a whole number from {low} to {high}")
        return round(value)

    def axes(
        self, key: str, limit: FloatArray, optional: bool = False, each: str = "an axis"
    ) -> FloatArray:
        """Return one number an axis, (n,), of magnitude up to `limit` (n,).

        With `optional` an axis may have none (null), which is nan in the result. `each` says in a
        refusal what the numbers are for, where it is not axes.
        """
        value = self._arguments.get(key)
        if not isinstance(value, Sequence) or isinstance(value, str) or len(value) != limit.size:
            raise self._refused(key, value, f"a list of {limit.size}, one number {each}")
        numbers = np.full(limit.size, math.nan)
        for i, entry in enumerate(value):
            if entry is not None or not optional:
                high = float(limit[i])
                numbers[i] = self._checked(key, i, entry, -high, high)
        return numbers

    def _checked(self, key: str, index: int | None, value: Any, low: float, high: float) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float):
            entry = key if index is None else f"{key}[{index}]"
            raise self._refused(entry, value, f"a number from {low:g} to {high:g}")
        if not low <= value <= high:  # nan is refused by this, too
            bounds = {"index": index, "low": low, "high": high}
            code = RefusalCode.OUT_OF_RANGE
            raise ProgramError(CommandRefusal(code, self._program, {key: value}, bounds))
        return float(value)

    def _refused(self, key: str, value: Any, allowed: str) -> ProgramError:
        return ProgramError(f"{self._program}: {key}: value {shown(value)}; allowed: {allowed}")

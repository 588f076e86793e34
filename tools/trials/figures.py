"""The figures of a trial: each has a value, a unit and perhaps a limit."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

_TEXT, _VALUE = 68, 10


@dataclass(frozen=True)
class Figure:
    """One figure; `limit` is its upper or, if `at_least`, lower limit; None without a limit."""

    key: str
    """Its name in JSON, with its unit."""
    text: str
    value: float
    unit: str = ""
    limit: float | None = None
    at_least: bool = False

    @property
    def reached(self) -> bool:
        """Whether the value keeps its limit; a value that is not a number does not."""
        if self.limit is None:
            return True
        return self.value >= self.limit if self.at_least else self.value <= self.limit

    def line(self) -> str:
        """Return the figure as a line of the table."""
        shown = f"{self.text:{_TEXT}}{self.value:{_VALUE}.4g} {self.unit:6}"
        if self.limit is None:
            return shown.rstrip()
        relation = "at least" if self.at_least else "at most"
        verdict = "reached" if self.reached else "MISSED"
        return f"{shown}wanted {relation} {self.limit:g}: {verdict}"

    def as_table(self) -> dict[str, Any]:
        """Return the figure for JSON."""
        return {
            "value": self.value,
            "unit": self.unit,
            "limit": self.limit,
            "wanted": None if self.limit is None else "at least" if self.at_least else "at most",
            "reached": self.reached,
        }


def all_reached(figures: Iterable[Figure]) -> bool:
    """Return whether every figure keeps its limit."""
    return all(figure.reached for figure in figures)

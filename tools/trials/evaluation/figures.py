"""The figures of a trial: a value with its unit, and what is wanted of it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

_TEXT, _VALUE = 68, 10


@dataclass(frozen=True)
class Figure:
    """One figure; `limit` is wanted at most, or at least, None where nothing is wanted of it."""

    key: str
    """Its name in JSON, with its unit."""
    text: str
    value: float
    unit: str = ""
    limit: float | None = None
    at_least: bool = False

    @property
    def reached(self) -> bool:
        """Whether the value is as wanted; one that is not a number is not."""
        if self.limit is None:
            return True
        return self.value >= self.limit if self.at_least else self.value <= self.limit

    def line(self) -> str:
        """Return it as a line of the table."""
        shown = f"{self.text:{_TEXT}}{self.value:{_VALUE}.4g} {self.unit:6}"
        if self.limit is None:
            return shown.rstrip()
        relation = "at least" if self.at_least else "at most"
        verdict = "reached" if self.reached else "MISSED"
        return f"{shown}wanted {relation} {self.limit:g}: {verdict}"

    def as_table(self) -> dict[str, Any]:
        """Return it for JSON."""
        return {
            "value": self.value,
            "unit": self.unit,
            "limit": self.limit,
            "wanted": None if self.limit is None else "at least" if self.at_least else "at most",
            "reached": self.reached,
        }


def all_reached(figures: Iterable[Figure]) -> bool:
    """Return whether every figure is as wanted."""
    return all(figure.reached for figure in figures)

"""The figures of a trial: each has a value, a unit and perhaps a limit."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from cdpr_tools.output import TableText


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

    def row(self) -> list[str]:
        """Return the figure as a row of the table."""
        shown = [self.text, f"{self.value:.4g}", self.unit]
        if self.limit is None:
            return [*shown, "", ""]
        relation = "at least" if self.at_least else "at most"
        return [*shown, f"{relation} {self.limit:g}", "reached" if self.reached else "MISSED"]

    def as_table(self) -> dict[str, Any]:
        """Return the figure for JSON."""
        return {
            "value": self.value,
            "unit": self.unit,
            "limit": self.limit,
            "wanted": None if self.limit is None else "at least" if self.at_least else "at most",
            "reached": self.reached,
        }


def figures_table(figures: Sequence[Figure]) -> TableText:
    """Return the figures as a table."""
    rows = [["", "value", "unit", "wanted", ""], *(figure.row() for figure in figures)]
    return TableText(rows, left=["unit", "wanted", ""])


def all_reached(figures: Iterable[Figure]) -> bool:
    """Return whether every figure keeps its limit."""
    return all(figure.reached for figure in figures)

"""Tables written as a row of column names and one array per row."""

from typing import Any

DASH = "—"


def dash_to_none(value: Any) -> Any:
    """Return None where the source has a dash, else the value."""
    return None if value == DASH else value


def records(columns: tuple[Any, ...], rows: tuple[Any, ...]) -> tuple[dict[str, Any], ...]:
    """Return the rows keyed by column name; raises ValueError for a row of another length."""
    for number, row in enumerate(rows):
        if not isinstance(row, tuple) or len(row) != len(columns):
            raise ValueError(f"row {number} is {row!r}; allowed: {len(columns)} values, as columns")
    return tuple(
        {str(name): dash_to_none(value) for name, value in zip(columns, row, strict=True)}
        for row in rows
    )

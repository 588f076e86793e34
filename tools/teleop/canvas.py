"""A picture of a plane made of characters: lines in dots of Braille, marks as letters."""

from __future__ import annotations

import math

_DOTS = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))
_BLANK = 0x2800


class Canvas:
    """`width` times `height` characters that show the plane from `low` to `high`, both (2,) in m.

    x goes to the right, y upward, both in one scale; the picture is in the middle.
    """

    def __init__(
        self, width: int, height: int, low: tuple[float, float], high: tuple[float, float]
    ) -> None:
        self._width, self._height = width, height
        columns, rows = 2 * width, 4 * height
        sides = max(high[0] - low[0], 1e-6), max(high[1] - low[1], 1e-6)
        self._per_m = min((columns - 1) / sides[0], (rows - 1) / sides[1])
        self._left = 0.5 * (columns - 1 - self._per_m * sides[0]) - self._per_m * low[0]
        self._top = 0.5 * (rows - 1 + self._per_m * sides[1]) + self._per_m * low[1]
        self._cells = [[0] * width for _ in range(height)]
        self._marks: dict[tuple[int, int], tuple[str, str]] = {}

    def line(self, begin: tuple[float, float], end: tuple[float, float]) -> None:
        """Draw a straight line; what lies outside is left out."""
        points = [self._dot(begin), self._dot(end)]
        if not all(math.isfinite(value) for point in points for value in point):
            return
        (x0, y0), (x1, y1) = points
        most = 4.0 * (2 * self._width + 4 * self._height)
        steps = math.ceil(min(max(abs(x1 - x0), abs(y1 - y0), 1.0), most))
        for k in range(steps + 1):
            part = k / steps
            column, row = round(x0 + part * (x1 - x0)), round(y0 + part * (y1 - y0))
            if 0 <= column < 2 * self._width and 0 <= row < 4 * self._height:
                self._cells[row // 4][column // 2] |= _DOTS[row % 4][column % 2]

    def outline(self, points: list[tuple[float, float]]) -> None:
        """Draw a closed line through points."""
        for begin, end in zip(points, [*points[1:], points[0]], strict=True):
            self.line(begin, end)

    def mark(self, at: tuple[float, float], letter: str, style: str) -> None:
        """Put a letter over what is there; one outside is left out."""
        x, y = self._dot(at)
        if not (math.isfinite(x) and math.isfinite(y)):
            return
        column, row = math.floor(x / 2.0), math.floor(y / 4.0)
        if 0 <= column < self._width and 0 <= row < self._height:
            self._marks[row, column] = letter, style

    def rows(self) -> list[list[tuple[str, str]]]:
        """Return each row as (characters, style) of its pieces, top first."""
        rows = []
        for row, cells in enumerate(self._cells):
            letters = "".join(chr(_BLANK + dots) if dots else " " for dots in cells)
            pieces, done = [], 0
            for column in sorted(column for at, column in self._marks if at == row):
                pieces += [(letters[done:column], ""), self._marks[row, column]]
                done = column + 1
            rows.append([*pieces, (letters[done:], "")])
        return rows

    def _dot(self, at: tuple[float, float]) -> tuple[float, float]:
        return self._left + self._per_m * at[0], self._top - self._per_m * at[1]

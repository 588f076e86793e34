"""Process that reads one recording for the daemon's service: a table, curves, or a picture."""

from __future__ import annotations

import json
import math
import sys
import tempfile
from pathlib import Path
from typing import Any, Final

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.cycle_row import FIELDS, column_names
from cdpr_rt.service.recording_reader import Columns
from cdpr_tools.errors import BAD_INPUT, DONE, BadInputError, CommandError
from cdpr_tools.recordings.selection import ELAPSED, Selection, write_csv

_MOST_COLUMNS: Final = 256
_DIGITS: Final = 9


class Envelope:
    """Smallest and largest values of curves (columns,) over stretches of the same number of rows.

    There are at most `most` stretches, or twice as many of one row. Whenever there would be more,
    pairs of them become one.
    """

    def __init__(self, most: int) -> None:
        self._most = max(2, most + most % 2)
        self.each = 1
        """Number of rows in a stretch."""
        self._rest = np.empty((0, 0))
        self._parts: list[FloatArray] = []
        """Stretches (k, columns, 2) of smallest and largest values; column 0 is the time."""
        self._count = 0

    def add(self, rows: FloatArray) -> None:
        """Add rows (k, columns)."""
        rest = self._rest if self._rest.size else rows[:0]
        joined = np.concatenate([rest, rows])
        whole = len(joined) - len(joined) % self.each
        self._rest = joined[whole:]
        self._append(_extremes(np.repeat(joined[:whole, :, None], 2, axis=2), self.each))
        while self._count > self._most * (2 if self.each == 1 else 1):
            one = np.concatenate(self._parts)
            self._parts, self._count = [], 0
            self.each *= 2
            self._append(_extremes(np.concatenate([one, one[len(one) - len(one) % 2 :]]), 2))

    def _append(self, part: FloatArray) -> None:
        if len(part):
            self._parts.append(part)
            self._count += len(part)

    def curves(self) -> FloatArray:
        """Return the points of the curves, (2 stretches, columns), or all rows if `each` is 1."""
        if len(self._rest):
            rest = np.repeat(self._rest[:, :, None], 2, axis=2)
            self._append(_extremes(rest, len(self._rest)))
        if not self._parts:
            return np.empty((0, 0))
        whole = np.concatenate(self._parts)
        return whole[:, :, 0] if self.each == 1 else whole.transpose(0, 2, 1).reshape(
            -1, whole.shape[1]
        )  # fmt: skip


def _extremes(stretches: FloatArray, each: int) -> FloatArray:
    """Return the smallest and largest values of every `each` of the stretches (k, columns, 2)."""
    if not len(stretches):
        return stretches
    grouped = stretches.reshape(-1, each, *stretches.shape[1:])
    # fmin and fmax ignore unknown values, unless all are unknown
    low = np.fmin.reduce(grouped[..., 0], axis=1)
    return np.stack([low, np.fmax.reduce(grouped[..., 1], axis=1)], axis=2)


def read_columns(selection: Selection, points: int) -> dict[str, Any]:
    """Return curves of the selected rows, as `models.Columns`. Raises BadInputError."""
    envelope, names, cycles = Envelope(points // 2), list[str](), 0
    for columns in selection.rows():
        flat, names = _flat(columns, selection.readers[0].axes)
        cycles += len(flat)
        envelope.add(flat)
    curves = envelope.curves()
    if not cycles:
        raise BadInputError("no cycles in the selected time")
    table = {name: _numbers(curves[:, k]) for k, name in enumerate(names)}
    return {"time_s": table.pop(ELAPSED), "columns": table, "cycles": cycles, "each": envelope.each}


def _flat(columns: Columns, axes: list[str]) -> tuple[FloatArray, list[str]]:
    names: list[str] = []
    parts: list[FloatArray] = []
    for field, values in columns.items():
        names += column_names(field, values.shape, axes)
        parts.append(values.reshape(len(values), -1).astype(float))
    if len(names) > _MOST_COLUMNS:
        raise BadInputError(f"{len(names)} curves; allowed: up to {_MOST_COLUMNS}")
    return np.concatenate(parts, axis=1), names


def _numbers(values: FloatArray) -> list[float | None]:
    return [float(f"{one:.{_DIGITS}g}") if math.isfinite(one) else None for one in values.tolist()]


def _write_picture(path: Path) -> None:
    from cdpr_tools.recordings.picture import FIELDS as DRAWN  # noqa: PLC0415  # slow to load
    from cdpr_tools.recordings.picture import draw  # noqa: PLC0415

    selection = Selection([path], DRAWN)
    with tempfile.TemporaryDirectory(prefix="cdpr-picture-") as folder:
        target = Path(folder) / "picture.png"
        draw(selection, selection.columns(), None, target)
        sys.stdout.buffer.write(target.read_bytes())


def main(kind: str, file: str, fields: str, from_s: str, until_s: str, points: str) -> int:
    """Write what was requested to standard output; return the exit status."""
    path, wanted = Path(file), [name for name in fields.split(",") if name in FIELDS] or None
    try:
        selection = Selection([path], wanted, float(from_s), float(until_s))
        if kind == "picture":
            _write_picture(path)
        elif kind == "csv":
            write_csv(selection, sys.stdout.buffer)
        else:
            print(json.dumps(read_columns(selection, int(points))))
    except CommandError as error:
        print(error, file=sys.stderr)
        return BAD_INPUT
    return DONE


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))

"""Rows of cycles as JSON texts, fast enough for every cycle of sixteen axes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.cycle_row import Row, cycle_dtype
from cdpr_rt.jit import jit

_FLOAT, _INTEGER, _BOOLEAN, _NOTHING = 0, 1, 2, 3
_KINDS: Final = {"f": _FLOAT, "i": _INTEGER, "u": _INTEGER, "b": _BOOLEAN}
_MOST_CHARS: Final = 26
"""Longest text of one value: sign, 19 digits, point and exponent of a float64."""
_BATCH: Final = 256

Bytes = NDArray[np.uint8]
Numbers = NDArray[np.int64]


class RowTexts:
    """Turns the fields `names` of rows for n axes into one JSON object each, in this order.

    Numbers are rounded to 1e-9 of their unit; what is not finite becomes null.
    """

    def __init__(self, n: int, names: Sequence[str]) -> None:
        self._fields: list[tuple[str, bool, slice]] = []
        used = {True: 0, False: 0}
        literals: list[str] = []
        kinds: list[int] = []
        columns: list[int] = []
        dtype = cycle_dtype(n)
        before = "{"
        for name in names:
            kind = _KINDS[dtype[name].base.kind]
            shape = dtype[name].shape
            width = shape[0] if shape else 1
            first = used[kind == _FLOAT]
            used[kind == _FLOAT] += width
            self._fields.append((name, kind == _FLOAT, slice(first, first + width)))
            literals += [f'{before}"{name}":{"[" if shape else ""}', *[","] * (width - 1)]
            kinds += [kind] * width
            columns += range(first, first + width)
            before = "]," if shape else ","
        literals.append(before.replace(",", "}"))
        self._literals = np.frombuffer("".join(literals).encode(), np.uint8)
        self._literal_ends = np.cumsum([len(text) for text in literals], dtype=np.int64)
        self._kinds = np.array([*kinds, _NOTHING], np.uint8)
        self._columns = np.array([*columns, 0], np.int64)
        self._floats = np.empty((_BATCH, used[True]))
        self._integers = np.empty((_BATCH, used[False]), np.int64)
        self._text = np.empty(_BATCH * (self._literals.size + _MOST_CHARS * len(kinds)), np.uint8)
        self._ends = np.empty(_BATCH, np.int64)
        self(np.zeros(1, dtype))  # compiles the kernel, while no rows wait for it yet

    def __call__(self, rows: Row) -> list[bytes]:
        """Return the text of each of `rows` (m,)."""
        texts: list[bytes] = []
        for first in range(0, rows.size, _BATCH):
            texts += self._batch(rows[first : first + _BATCH])
        return texts

    def _batch(self, rows: Row) -> list[bytes]:
        m = rows.size
        for name, is_float, columns in self._fields:
            values = self._floats if is_float else self._integers
            values[:m, columns] = rows[name].reshape(m, -1)
        size = _write(
            self._literals, self._literal_ends, self._kinds, self._columns, self._floats[:m],
            self._integers[:m], self._text, self._ends,
        )  # fmt: skip
        text = self._text[:size].tobytes()
        ends = self._ends[:m].tolist()
        return [text[a:b] for a, b in zip([0, *ends[:-1]], ends, strict=True)]


@jit
def _write_integer(out: Bytes, at: int, value: int) -> int:
    """Write a number that is not negative; return where it ends."""
    digits = 1
    power = 10
    while digits < 19 and value >= power:
        digits += 1
        power *= 10
    rest = value
    for k in range(digits - 1, -1, -1):
        out[at + k] = 48 + rest % 10
        rest //= 10
    return at + digits


@jit
def _write_float(out: Bytes, at: int, value: float) -> int:
    """Write a number to nine places, without trailing zeros; return where it ends."""
    if not np.isfinite(value):
        for code in (110, 117, 108, 108):  # null
            out[at] = code
            at += 1
        return at
    size = min(abs(value), 1e308)  # a digit off at the very end must not make it infinite
    exponent = 0
    while size >= 9e9:  # or a 64-bit integer would not hold it in billionths
        size /= 10.0
        exponent += 1
    billionths = int(size * 1e9 + 0.5)
    if value < 0.0 and billionths > 0:
        out[at] = 45  # -
        at += 1
    at = _write_integer(out, at, billionths // 1_000_000_000)
    fraction = billionths % 1_000_000_000
    if fraction > 0:
        out[at] = 46  # .
        places = 9
        while fraction % 10 == 0:
            fraction //= 10
            places -= 1
        for k in range(places, 0, -1):
            out[at + k] = 48 + fraction % 10
            fraction //= 10
        at += places + 1
    if exponent > 0:
        out[at] = 101  # e
        at = _write_integer(out, at + 1, exponent)
    return at


@jit
def _write(
    literals: Bytes,
    literal_ends: Numbers,
    kinds: Bytes,
    columns: Numbers,
    floats: FloatArray,
    integers: Numbers,
    out: Bytes,
    ends: Numbers,
) -> int:
    """Write the text of each row of `floats` and `integers`; return where the last one ends.

    A text is a sequence of literals, each followed by the value of one column, or by nothing.
    """
    at = 0
    for row in range(floats.shape[0]):
        literal = 0
        for k in range(kinds.size):
            while literal < literal_ends[k]:
                out[at] = literals[literal]
                at += 1
                literal += 1
            kind, column = kinds[k], columns[k]
            if kind == _FLOAT:
                at = _write_float(out, at, floats[row, column])
            elif kind == _INTEGER:
                value = integers[row, column]
                if value < 0:
                    out[at] = 45
                    at += 1
                at = _write_integer(out, at, abs(value))
            elif kind == _BOOLEAN:
                is_true = integers[row, column] != 0
                word = (116, 114, 117, 101, 32) if is_true else (102, 97, 108, 115, 101)
                for j in range(4 if is_true else 5):
                    out[at] = word[j]
                    at += 1
        ends[row] = at
    return at

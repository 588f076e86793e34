"""Writes the row of each cycle into the shared ring."""

from __future__ import annotations

import struct
from operator import attrgetter
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from cdpr_rt.arrays import FloatArray, IntArray
from cdpr_rt.core.cycle_row import AXIS_FIELDS, POSE_FIELDS, SCALAR_FIELDS, CycleField
from cdpr_rt.core.shared_block import RowWriter, SharedBlock
from cdpr_rt.jit import bound, copy_bytes, jit

_CODES: Final = {
    "<u8": "Q", "<i8": "q", "<f8": "d", "<u4": "I", "<i4": "i", "<u2": "H", "<i2": "h", "<u1": "B",
    "?": "?",
}  # fmt: skip
"""Codes of `struct` by those of NumPy."""
_SCALARS = struct.Struct("<" + "".join(_CODES[field.kind] for field in SCALAR_FIELDS))
_scalars_of = attrgetter(*(field.source for field in SCALAR_FIELDS))
_axes_of = attrgetter(*(field.source for field in AXIS_FIELDS))
_poses_of = attrgetter(*(field.source for field in POSE_FIELDS))
_UNKNOWN = np.full(7, np.nan)


@jit
def _fill(
    copies: IntArray,
    rows: int,
    size: int,
    pose_rows: FloatArray,
    poses: tuple[FloatArray, ...],
    k: int,
) -> None:
    for j in range(copies.shape[0]):
        copy_bytes(rows + k * size + copies[j, 0], copies[j, 1], copies[j, 2])
    for j in range(len(poses)):
        for i in range(7):
            pose_rows[k, j, i] = poses[j][i]


class CycleRows:
    """Fills one row a cycle in place, without allocating memory that stays.

    The scalars, which come first in a row, are packed in one call. Arrays over the axes are copied
    from their addresses: passing them all to compiled code costs more than copying them.
    """

    def __init__(self, block: SharedBlock) -> None:
        self._writer = RowWriter(block)
        rows, n = block.rows, block.n
        self._rows = rows
        self._raw = memoryview(rows.view(np.uint8).data)
        self._size = rows.dtype.itemsize
        self._capacity = block.capacity
        self._written = int(block.counters["rows"][0])
        shape, at = (self._capacity, len(POSE_FIELDS), 7), self._offset(POSE_FIELDS[0])
        self._poses = np.ndarray(shape, "<f8", self._raw, at, (self._size, 7 * 8, 8))
        # compiled here, not in a cycle
        self._bind(tuple(np.zeros(n, field.kind) for field in AXIS_FIELDS))

    def _offset(self, field: CycleField) -> int:
        fields: Any = self._rows.dtype.fields
        return int(fields[field.name][1])

    def _bind(self, axes: tuple[NDArray[Any], ...]) -> None:
        copies = np.zeros((len(axes), 3), np.int64)
        for copy, field, values in zip(copies, AXIS_FIELDS, axes, strict=True):
            kind, allowed = np.dtype((values.dtype, values.shape)), self._rows.dtype[field.name]
            if kind != allowed or not values.flags.c_contiguous:
                raise TypeError(f"{field.source}: {kind}; allowed: {allowed}, contiguous")
            copy[:] = self._offset(field), values.ctypes.data, values.nbytes
        self._axes = axes  # their addresses hold as long as they live
        rows, then = self._rows.ctypes.data, ((_UNKNOWN,) * len(POSE_FIELDS), 0)
        self._fill = bound(_fill, copies, rows, self._size, self._poses, then=then)

    def follow(self, engine: Any) -> None:
        """Bind the arrays over the axes that `engine` has now at the sources of their fields.

        Raises TypeError where one has another type, length or layout than its field.
        """
        self._bind(_axes_of(engine))

    def write(self, engine: Any) -> None:
        """Write and publish one row of the present values of `engine`."""
        k = self._written % self._capacity
        _SCALARS.pack_into(self._raw, k * self._size, *_scalars_of(engine))
        poses = tuple([_UNKNOWN if pose is None else pose for pose in _poses_of(engine)])
        self._fill(poses, k)
        self._written += 1
        self._writer.commit()

"""Reads the simulator's log of the true motion; the report alone uses it."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cdpr_rt.exchange import FloatArray
from tools.errors import BadInputError

_HEADER_BYTES = 1024
_FORMAT = "cdpr-rt truth log 1"
_WANTED = (("sync_index", "i8"), ("angle_from_index_rad", "f8"), ("temperature_rise_K", "f8"))
_PIECE = 65536


@dataclass(frozen=True)
class Truth:
    """True angle from the index at each SYNC the simulator saw, and the temperature rise."""

    sync_index: np.ndarray[tuple[int], np.dtype[np.int64]]
    angle_rad: FloatArray
    rise_K: FloatArray

    def angle_at(self, sync_index: FloatArray) -> FloatArray:
        """Return the true angle at given SYNCs, (k,); raises BadInputError where one is missing."""
        place = np.searchsorted(self.sync_index, sync_index)
        if place.size and (
            place[-1] >= self.sync_index.size
            or not np.array_equal(self.sync_index[place], sync_index)
        ):
            raise BadInputError("the simulator's log does not hold all SYNCs of the recording")
        return self.angle_rad[place]


def read_truth(path: Path) -> Truth:
    """Read the log piece by piece, since it may be long; raises BadInputError when it is none."""
    try:
        with path.open("rb") as file:
            header = json.loads(file.read(_HEADER_BYTES))
            dtype = np.dtype([(name, kind) for name, kind in header["fields"]])
            if header["format"] != _FORMAT or header["record_bytes"] != dtype.itemsize:
                raise ValueError(header["format"])
            pieces = []
            while (records := np.fromfile(file, dtype, _PIECE)).size:
                pieces.append([records[name].astype(kind) for name, kind in _WANTED])
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise BadInputError(f"{path}: not a log of the simulator: {error}") from error
    if not pieces:
        raise BadInputError(f"{path}: holds no whole record")
    return Truth(*(np.concatenate(column) for column in zip(*pieces, strict=True)))

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
    """Read the log; raises BadInputError when it is none."""
    try:
        data = path.read_bytes()
        header = json.loads(data[:_HEADER_BYTES])
        dtype = np.dtype([(name, kind) for name, kind in header["fields"]])
        if header["format"] != _FORMAT or header["record_bytes"] != dtype.itemsize:
            raise ValueError(header["format"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise BadInputError(f"{path}: not a log of the simulator: {error}") from error
    body = data[_HEADER_BYTES:]
    records = np.frombuffer(body, dtype, len(body) // dtype.itemsize)
    return Truth(
        records["sync_index"].astype(np.int64),
        records["angle_from_index_rad"].astype(float),
        records["temperature_rise_K"].astype(float),
    )

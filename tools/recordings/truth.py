"""Read the simulator's log of the true motion; only the report uses it."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cdpr_profiles.bounded_input import open_regular, parse_json
from cdpr_profiles.errors import ProfileError
from cdpr_rt.arrays import FloatArray
from cdpr_rt.identification.commissioning_results import AngleOf, Recording
from cdpr_rt.identification.rawlog import RawLog
from cdpr_tools.errors import BadInputError

_HEADER_BYTES = 1024
_FORMAT = "cdpr-rt truth log 1"
NO_SYNC = 0xFFFFFFFF
"""SYNC number of a record that was made without a SYNC."""


class Truth:
    """The log of the true motion; only the needed records are read, because it may be long.

    Raises BadInputError if `path` is no such log.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        try:
            with os.fdopen(open_regular(path), "rb") as file:
                header = parse_json(file.read(_HEADER_BYTES), path)
            self._dtype: np.dtype[Any] = np.dtype([(n, kind) for n, kind in header["fields"]])
            if header["format"] != _FORMAT or header["record_bytes"] != self._dtype.itemsize:
                raise ValueError(header["format"])
        except (ProfileError, OSError, ValueError, KeyError, TypeError) as error:
            raise BadInputError(f"{path}: not a log of the simulator: {error}") from error
        self._at_sync: NDArray[np.intp] = np.zeros(0, np.intp)
        """Numbers of the records made at a SYNC, among the first `_searched` records."""
        self._searched = 0

    def angle_of(self, log: RawLog, run: Recording) -> FloatArray:
        """Return the true angle of a recorded pass, (samples,); raises the errors of `angle_at`."""
        return self.angle_at(run.cycle + log.header["sync_offset"] - 1, run.sweep.angle_rad)

    def angle_at(self, sync_index: FloatArray, measured_rad: FloatArray) -> FloatArray:
        """Return the true angle from the index at given SYNCs in rising order, (k,).

        The index comes once a turn. The drive and the simulator may count from the index of
        different turns. So whole turns are added until the angle agrees with the measured one,
        (k,). Raises BadInputError if a SYNC is missing.
        """
        first, last = int(sync_index[0]), int(sync_index[-1])
        # one record per SYNC, counted from zero
        records = self._records_at_sync(max(first, 0), last)
        place = sync_index.astype(np.int64) - first
        if records.size != last - first + 1 or not np.array_equal(
            records["sync_index"][place], sync_index
        ):
            raise BadInputError(
                f"{self._path}: does not contain the SYNCs {first} to {last} of a recording"
            )
        angle = np.asarray(records["angle_from_index_rad"][place], float)
        turns = round(float(np.median(measured_rad - angle)) / math.tau)
        return angle + turns * math.tau

    def _records_at_sync(self, first: int, last: int) -> NDArray[np.void]:
        """Return the available records of these SYNCs; the log may have grown meanwhile."""
        whole = (self._path.stat().st_size - _HEADER_BYTES) // self._dtype.itemsize
        records = np.memmap(self._path, self._dtype, "r", _HEADER_BYTES, (whole,))
        found = np.flatnonzero(records["sync_index"][self._searched :] != NO_SYNC)
        self._at_sync = np.concatenate([self._at_sync, found + self._searched])
        self._searched = whole
        return np.asarray(records[self._at_sync[first : last + 1]])


def true_angle(path: Path) -> AngleOf | None:
    """Return a function for the true angle of a pass from the log at `path`, None without a log."""
    return Truth(path).angle_of if path.exists() else None

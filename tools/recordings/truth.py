"""Read the simulator's logs: a motor's true motion, a robot's true poses, a scanner's readings.

Only reports, trials, tests and the comparison of a calibration with the truth use them.
"""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from cdpr_profiles.bounded_input import open_regular, parse_json
from cdpr_profiles.errors import ProfileError
from cdpr_rt.arrays import FloatArray
from cdpr_rt.identification.commissioning_results import AngleOf, Recording
from cdpr_rt.identification.rawlog import RawLog
from cdpr_tools.errors import BadInputError

_HEADER_BYTES = 1024
TRUTH, POSES, SCANNER = "cdpr-rt truth log 1", "cdpr-rt pose log 1", "cdpr-rt scanner log 1"
"""Formats of the logs."""
NO_SYNC = 0xFFFFFFFF
"""SYNC number of a record that was made without a SYNC."""

PoseRecords = NDArray[np.void]
"""Records of a log of poses, (k,): `sync_index`, `time_s` (bus time), `position_m` (3,),
`velocity_m_s` (3,), `rotation` (3, 3), `tension_N` (n,) and `motor_rad` (n,), all true at that
time."""


class RecordLog:
    """A log that may still be written; its records can be read at any time.

    Raises BadInputError if `path` is no log of this format.
    """

    def __init__(self, path: Path, form: str) -> None:
        self.path = path
        self._fd = -1
        try:
            self._fd = open_regular(path)
            self.header: dict[str, Any] = parse_json(os.pread(self._fd, _HEADER_BYTES, 0), path)
            fields = [
                (name, kind, *map(tuple, rest)) for name, kind, *rest in self.header["fields"]
            ]
            self.dtype: np.dtype[Any] = np.dtype(fields)
            if (self.header["format"], self.header["record_bytes"]) != (form, self.dtype.itemsize):
                raise ValueError(self.header["format"])
        except (ProfileError, OSError, ValueError, KeyError, TypeError) as error:
            self.close()
            raise BadInputError(f"{path}: not a log of the simulator: {error}") from error

    def __len__(self) -> int:
        return max(0, os.fstat(self._fd).st_size - _HEADER_BYTES) // self.dtype.itemsize

    def last(self) -> Any:
        """Return the newest record, a scalar of `dtype`; raises BadInputError for an empty log."""
        count = len(self)
        if not count:
            raise BadInputError(f"{self.path}: holds no record yet")
        return self.read(count - 1, count)[0]

    def read(self, first: int = 0, last: int | None = None) -> PoseRecords:
        """Return the records from `first` to before `last`, or fewer if the log is shorter."""
        size = self.dtype.itemsize
        last = len(self) if last is None else min(last, len(self))
        parts, at, end = [], _HEADER_BYTES + first * size, _HEADER_BYTES + last * size
        while at < end:
            parts.append(os.pread(self._fd, end - at, at))
            at += len(parts[-1])
        return np.frombuffer(b"".join(parts), self.dtype)

    def close(self) -> None:
        """Close the file; safe to repeat."""
        fd, self._fd = self._fd, -1
        if fd >= 0:
            os.close(fd)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def read_pose_log(path: Path, *, without_sync: bool = False) -> PoseRecords:
    """Return the records of SYNCs or, if `without_sync`, also those without one (`NO_SYNC`).

    Raises BadInputError if `path` is no such log.
    """
    with RecordLog(path, POSES) as log:
        records = log.read()
    return records if without_sync else records[records["sync_index"] != NO_SYNC]


class Truth:
    """The log of a motor's true motion; only the needed records are read, because it may be long.

    Raises BadInputError if `path` is no such log.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        with RecordLog(path, TRUTH) as log:
            self._dtype = log.dtype
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

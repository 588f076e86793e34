"""Read the simulator's log of a robot's true pose; only reports, trials and tests use it."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from cdpr_profiles.bounded_input import open_regular, parse_json
from cdpr_profiles.errors import ProfileError
from cdpr_tools.errors import BadInputError
from cdpr_tools.recordings.truth import NO_SYNC

_HEADER_BYTES = 1024
_FORMAT = "cdpr-rt pose log 1"

Truth = NDArray[np.void]
"""Records of the log, (k,): `sync_index`, `time_s` (bus time), `position_m` (3,), `velocity_m_s`
(3,), `rotation` (3, 3), `tension_N` (n,) and `motor_rad` (n,), all true at that time."""


class PoseLogTail:
    """A log that is still being written; its newest record can be read at any time.

    Raises BadInputError if `path` is no such log.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._fd = -1
        try:
            self._fd = open_regular(path)
            header = parse_json(os.pread(self._fd, _HEADER_BYTES, 0), path)
            self.dtype = _dtype(header["fields"])
            if header["format"] != _FORMAT or header["record_bytes"] != self.dtype.itemsize:
                raise ValueError(header["format"])
        except (ProfileError, OSError, ValueError, KeyError, TypeError) as error:
            self.close()
            raise BadInputError(f"{path}: not a log of true poses: {error}") from error

    def __len__(self) -> int:
        return max(0, os.fstat(self._fd).st_size - _HEADER_BYTES) // self.dtype.itemsize

    def last(self) -> Any:
        """Return the newest record, a scalar of `dtype`; raises BadInputError without one."""
        count = len(self)
        if not count:
            raise BadInputError(f"{self.path}: holds no record yet")
        return self.read(count - 1, count)[0]

    def read(self, first: int = 0, last: int | None = None) -> Truth:
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


def read_pose_log(path: Path, *, without_sync: bool = False) -> Truth:
    """Return the records of SYNCs or, if `without_sync`, also those without one (`NO_SYNC`).

    Raises BadInputError if `path` is no such log.
    """
    with PoseLogTail(path) as log:
        records = log.read()
    return records if without_sync else records[records["sync_index"] != NO_SYNC]


def _dtype(fields: list[list[Any]]) -> np.dtype[np.void]:
    return np.dtype([(name, kind, *map(tuple, shape)) for name, kind, *shape in fields])

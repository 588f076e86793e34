"""True angles at SYNCs are read from a growing log that also has records without SYNC."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from cdpr_tools.errors import BadInputError
from cdpr_tools.recordings.truth import NO_SYNC, Truth

DTYPE = np.dtype([("sync_index", "<u4"), ("angle_from_index_rad", "<f4")])


def records(syncs: list[int]) -> bytes:
    rows = np.array([(k, 0.0 if k == NO_SYNC else 0.01 * k) for k in syncs], DTYPE)
    return rows.tobytes()


def write(path: Path, syncs: list[int]) -> None:
    fields = [[name, DTYPE[name].str] for name in DTYPE.names or ()]
    header = {"format": "cdpr-rt truth log 1", "record_bytes": DTYPE.itemsize, "fields": fields}
    path.write_bytes(json.dumps(header).encode().ljust(1024) + records(syncs))


def test_records_without_sync_are_skipped_and_later_ones_found(tmp_path: Path) -> None:
    path = tmp_path / "truth.log"
    write(path, [0, 1, NO_SYNC, NO_SYNC, 2, 3, NO_SYNC])
    truth = Truth(path)
    asked = np.array([1.0, 2.0, 3.0])
    assert truth.angle_at(asked, 0.01 * asked) == pytest.approx(0.01 * asked)
    with pytest.raises(BadInputError, match="SYNCs 3 to 5"):
        truth.angle_at(np.array([3.0, 4.0, 5.0]), np.zeros(3))
    with path.open("ab") as log:
        log.write(records([4, NO_SYNC, 5]) + b"half")
    asked = np.array([3.0, 5.0])
    turned = 0.01 * asked + 2 * math.tau
    assert truth.angle_at(asked, turned) == pytest.approx(turned)

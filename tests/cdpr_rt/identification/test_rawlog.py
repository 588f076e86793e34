"""Raw logs: truncated and damaged files, and full disks."""

from pathlib import Path

import numpy as np
import pytest

from cdpr_rt.errors import RawLogError
from cdpr_rt.identification.rawlog import RawLogWriter, read_raw_log

ROWS = np.arange(30.0).reshape(10, 3)


def write(path: Path) -> None:
    log = RawLogWriter(path, ["cycle", "time_s", "position_rad[0]"], {"axes": 1})
    log.write(ROWS[:4])
    log.write(ROWS[4:])
    log.close()


def test_a_log_is_read_back_unchanged(tmp_path: Path) -> None:
    write(tmp_path / "a.raw")
    log = read_raw_log(tmp_path / "a.raw")
    assert log.complete
    np.testing.assert_array_equal(log.rows, ROWS)
    np.testing.assert_array_equal(log.column("position_rad"), ROWS[:, 2])


def test_a_truncated_file_keeps_its_whole_rows(tmp_path: Path) -> None:
    path = tmp_path / "a.raw"
    write(path)
    data = path.read_bytes()
    for cut in (1, 23, 24, 25, 24 * 9):
        path.write_bytes(data[:-cut])
        log = read_raw_log(path)
        assert not log.complete
        np.testing.assert_array_equal(log.rows, ROWS[: (240 - cut) // 24])


def test_errors_of_unreadable_logs_state_the_reason(tmp_path: Path) -> None:
    path = tmp_path / "a.raw"
    with pytest.raises(RawLogError, match=r"a\.raw"):
        read_raw_log(path)
    for data in (b"", b"{}", b"not json\n" * 1000):
        path.write_bytes(data)
        with pytest.raises(RawLogError, match=r"a\.raw: not a raw log"):
            read_raw_log(path)
    write(path)
    path.write_bytes(path.read_bytes()[:4100])
    with pytest.raises(RawLogError, match="no complete row"):
        read_raw_log(path)
    write(path)
    with pytest.raises(RawLogError, match="no column 'effort_Nm'"):
        read_raw_log(path).column("effort_Nm")


def test_a_full_disk_is_one_clear_error() -> None:
    full = Path("/dev/full")
    with pytest.raises(RawLogError, match="cannot record: No space left"):
        RawLogWriter(full, ["cycle"], {})

"""Recordings and their disk: full, small or removed; file names and order of writes."""

import io
import os
import shutil
import threading
import time
from pathlib import Path

import pytest
from mcap.reader import NonSeekingReader, make_reader
from waiting import until

from cdpr_rt.core.shared_block import RowWriter
from cdpr_rt.service.recording import Recorder, reserve_of
from cdpr_rt.service.recording_reader import RecordingReader
from cdpr_rt.service.retention import Retention
from tests.cdpr_rt.service.recording_rig import (
    block_with_clock,
    made_rows,
    put,
    run_for,
    stock_cycles,
)

pytestmark = pytest.mark.long


def test_the_file_is_readable_after_power_fails_during_any_write(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Power may fail between any two writes and in the middle of each."""
    writes: list[tuple[bytes, int]] = []
    pwrite = os.pwrite

    def noted(fd: int, data: bytes, at: int) -> int:
        writes.append((bytes(data), at))
        return pwrite(fd, data, at)

    monkeypatch.setattr(os, "pwrite", noted)
    block = block_with_clock()
    recorder = Recorder(block, tmp_path, "bench", reserve_bytes=0)
    recorder.start()
    writer, at = RowWriter(block), 0
    while len(writes) <= 6:  # until the recorder has written often enough
        at = run_for(writer, 0.5, at)
    recorder.stop()
    disk, least = bytearray(), 0
    for data, at in writes:
        if not disk:
            disk[:] = data
            continue
        torn = disk.copy()
        half = data[: len(data) // 2]
        torn[at : at + len(half)] = half
        kept = NonSeekingReader(io.BytesIO(torn)).iter_messages(["/cycle"])
        if len(data) > 100:  # the few bytes of the old end are in one sector
            assert sum(1 for _ in kept) >= least
        disk[at : at + len(data)] = data
        count = sum(1 for _ in make_reader(io.BytesIO(disk)).iter_messages(["/cycle"]))
        assert count >= least
        least = count
    assert least == recorder.status()["rows"] > 0 and len(writes) > 4


def test_rows_reach_the_disk_although_new_ones_keep_arriving(tmp_path: Path) -> None:
    block = block_with_clock(seconds=60.0)
    recorder = Recorder(block, tmp_path, "bench", reserve_bytes=0)
    newest = block.counters["rows"]
    end = threading.Event()

    def feed() -> None:
        while not end.is_set():
            if newest[0] - recorder._reader.next < 20_000:
                newest[0] += 2_000
            time.sleep(0)

    thread = threading.Thread(target=feed)
    recorder.start()
    thread.start()
    try:
        until(lambda: int(block.counters["recorded"][0]) > 0)
    finally:
        end.set()
        thread.join()
        recorder.stop()


def test_a_file_that_is_removed_ends_the_recording(tmp_path: Path) -> None:
    folder = tmp_path / "recordings"
    recorder = Recorder(block_with_clock(), folder, "bench")
    recorder.start()
    shutil.rmtree(folder)
    until(lambda: recorder.status()["error"])
    recorder.stop()
    assert "001.mcap: recording ended: the file has been removed" in recorder.status()["error"]


def test_recorders_started_in_the_same_second_use_different_files(tmp_path: Path) -> None:
    recorders = [Recorder(block_with_clock(), tmp_path, "bench") for _ in range(4)]
    threads = [threading.Thread(target=recorder.start) for recorder in recorders]
    for thread in threads:
        thread.start()
    for thread, recorder in zip(threads, recorders, strict=True):
        thread.join()
        recorder.stop()
    assert [recorder.status()["error"] for recorder in recorders] == [""] * 4
    assert len(list(tmp_path.iterdir())) == 4


def test_file_numbers_continue_beyond_999(tmp_path: Path) -> None:
    for number in (999, 1000):
        (tmp_path / f"bench-20270115T080000Z-{number}.mcap").write_bytes(b"")
    recorder = Recorder(block_with_clock(), tmp_path, "bench")
    recorder.start()
    recorder.stop()
    assert recorder.status()["error"] == "" and recorder.status()["file"].endswith("-1001.mcap")


def test_a_small_disk_keeps_a_small_reserve(tmp_path: Path) -> None:
    assert reserve_of(20 << 20) == 1 << 20
    assert reserve_of(1 << 40) == 64 << 20


def test_an_unusable_folder_is_reported_at_the_start(tmp_path: Path) -> None:
    folder = tmp_path / "file"
    folder.write_text("")
    ends: list[str] = []
    recorder = Recorder(block_with_clock(), folder, "bench", ended=ends.append)
    recorder.start()
    recorder.stop()
    assert ends == [recorder.status()["error"]]
    assert not recorder.status()["recording"] and "cannot record" in recorder.status()["error"]


def test_recording_ends_before_the_disk_is_full(tmp_path: Path) -> None:
    block = block_with_clock()
    ends: list[str] = []
    recorder = Recorder(block, tmp_path, "bench", reserve_bytes=1 << 60, ended=ends.append)
    recorder.start()
    put(RowWriter(block), made_rows(0, 10))
    until(lambda: recorder.status()["error"])
    recorder.stop()
    assert "GB free, less than the 1.15e+09 GB reserved" in recorder.status()["error"] and ends == [
        recorder.status()["error"]
    ]
    (path,) = tmp_path.iterdir()
    assert stock_cycles(path) == list(range(10))


def test_retention_removes_the_oldest_recordings_beyond_age_and_size(tmp_path: Path) -> None:
    def leave(name: str, days: float) -> Path:
        path = tmp_path / name
        path.write_bytes(bytes(1000))
        os.utime(path, (time.time() - 86400.0 * days,) * 2)
        return path

    old = [leave(f"bench-2026010{day}T080000Z-001.mcap", 40.0 - day) for day in (1, 2, 3)]
    others = [
        leave("bench-2-20260101T080000Z-001.mcap", 99.0),
        leave("bench-by-hand.mcap", 99.0),
        leave("bench-20260101T080000Z-001.png", 99.0),
    ]
    writing = leave("bench-20270101T080000Z-001.mcap", 0.0)
    assert Retention(days=37.5).prune(tmp_path, "bench") == old[:2]
    assert Retention(total_bytes=1500.0).prune(tmp_path, "bench") == old[2:]
    assert Retention(days=0.0, total_bytes=0.0).prune(tmp_path, "bench") == []
    assert writing.exists() and all(path.exists() for path in others)

    leave("bench-20260102T080000Z-001.mcap", 20.0)
    gone = leave("bench-20260101T080000Z-001.mcap", 40.0)
    recorder = Recorder(block_with_clock(), tmp_path, "bench", retention=Retention(days=30.0))
    recorder.start()
    recorder.stop()
    assert not gone.exists() and Path(recorder.status()["file"]).exists()
    reader = RecordingReader(Path(recorder.status()["file"]))
    assert list(reader.cycles()) == []
    told = [event["text"] for event in reader.events]
    assert f"removed 1 old recordings: {gone.name}" in told


def test_a_clock_correction_removes_no_recording(tmp_path: Path) -> None:
    now_s = time.time()
    for k, written_s in enumerate((3600.0, 7200.0, now_s - 7200.0, now_s + 9e8)):
        path = tmp_path / f"bench-2026010{k + 1}T080000Z-001.mcap"
        path.write_bytes(bytes(1000))
        os.utime(path, (written_s, written_s))
    assert Retention(days=30.0).prune(tmp_path, "bench") == []
    # the size limit still applies, and the newest file stays
    assert len(Retention(total_bytes=1.0).prune(tmp_path, "bench")) == 3

"""Recording: no row is missing however it ends, and the `mcap` package reads it."""

import json
import os
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import Writer
from waiting import until

from cdpr_rt.core.cycle_row import FIELDS, WALL_TIMES
from cdpr_rt.core.shared_block import RowWriter
from cdpr_rt.core.states import Reaction
from cdpr_rt.motion.pose_stream import confirmation, stream_buttons
from cdpr_rt.service.recording import EventDetector, Recorder
from cdpr_rt.service.recording_file import RecordingError
from cdpr_rt.service.recording_reader import CLOSED, CUT, Columns, RecordingReader
from tests.cdpr_rt.service.recording_rig import (
    DESCRIPTION,
    block_with_clock,
    made_rows,
    put,
    run_for,
    stock_cycles,
    stock_messages,
)


def _recorded(folder: Path, rows: int = 3000) -> Path:
    block = block_with_clock()
    recorder = Recorder(block, folder, "bench", reserve_bytes=0)
    put(RowWriter(block), made_rows(0, rows))
    recorder.start()
    recorder.stop()
    assert recorder.status()["error"] == ""
    return Path(recorder.status()["file"])


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return _recorded(tmp_path_factory.mktemp("recording"))


def test_every_row_is_recorded_unchanged(recorded: Path) -> None:
    messages = stock_messages(recorded, "/cycle")
    rows = made_rows(0, 3000)
    assert [value["cycle"] for _, value in messages] == list(range(3000))
    assert messages[2999][1]["position_rad"] == pytest.approx(rows["position_rad"][2999], abs=1e-9)
    assert messages[0][1]["cable_length_m"] == [None, None]
    # the time of day follows from one instant that was read on both clocks
    assert [at for at, _ in messages] == [
        1_800_000_000_000_000_000 + k * 1_000_000 for k in range(3000)
    ]
    assert stock_messages(recorded, "/description")[0][1] == DESCRIPTION
    assert stock_messages(recorded, "/status")[0][1]["state"] == "active"
    assert recorded.name == "bench-20270115T080000Z-001.mcap"


def read_columns(path: Path, fields: list[str] | None = None) -> Columns:
    parts = list(RecordingReader(path).cycles(fields))
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def test_a_recording_is_read_back_as_columns(recorded: Path) -> None:
    rows = made_rows(0, 3000)
    columns = read_columns(recorded)
    for name in ("cycle", "stamp_ns", "statusword", "valid", "state"):
        assert (columns[name] == rows[name]).all()
    for name in ("torque_sent_Nm", "tension_N", "cable_length_m", "pose", "stream_age_s"):
        assert (
            abs(columns[name] - rows[name]).max() < 1e-9 or (columns[name] != columns[name]).all()
        )
    assert list(columns) == list(FIELDS)
    for fields in (["cycle"], ["cycle", "pose"], ["pose", "stamp_ns"], ["compute_s"]):
        assert set(read_columns(recorded, fields)) == set(fields)


def _without_some_messages(path: Path, out: Path, dropped: set[tuple[str, int]]) -> Path:
    """Rewrite the file in small chunks, without messages of some topics and cycles."""
    with path.open("rb") as file, out.open("wb") as target:
        reader = make_reader(file)
        writer = Writer(target, chunk_size=3000)
        writer.start(profile="cdpr-rt")
        for record in reader.iter_metadata():
            writer.add_metadata(record.name, record.metadata)
        ids: dict[str, int] = {}
        for schema, channel, message in reader.iter_messages(log_time_order=False):
            assert schema is not None
            if channel.topic not in ids:
                schema_id = writer.register_schema(schema.name, schema.encoding, schema.data)
                ids[channel.topic] = writer.register_channel(channel.topic, "json", schema_id)
            cycle = json.loads(message.data).get("cycle", -1)
            if (channel.topic, cycle) not in dropped:
                writer.add_message(ids[channel.topic], message.log_time, message.data, 0)
        writer.finish()  # type: ignore[no-untyped-call]
    return out


def test_wall_times_are_stored_separately_and_joined_again(tmp_path: Path) -> None:
    path = _recorded(tmp_path, 500)
    assert not set(WALL_TIMES) & stock_messages(path, "/cycle")[0][1].keys()
    assert set(WALL_TIMES) < stock_messages(path, "/timing")[0][1].keys()
    chunks = tmp_path / "chunks.mcap"  # many chunks end between a row and its timing
    _without_some_messages(path, chunks, set())
    with chunks.open("rb") as file:
        summary = make_reader(file).get_summary()
        assert summary is not None and len(summary.chunk_indexes) > 100
    assert (read_columns(chunks)["stamp_ns"] == made_rows(0, 500)["stamp_ns"]).all()
    # the last row is missing although its timing is in the file
    _without_some_messages(path, chunks, {("/cycle", 499)})
    assert (read_columns(chunks)["stamp_ns"] == made_rows(0, 499)["stamp_ns"]).all()


def test_a_row_never_gets_the_timing_of_another(tmp_path: Path) -> None:
    path = _recorded(tmp_path, 500)
    damaged = _without_some_messages(path, tmp_path / "damaged.mcap", {("/timing", 300)})
    reader = RecordingReader(damaged)
    rows = [int(stamp) for part in reader.cycles() for stamp in part["stamp_ns"]]
    assert reader.ended == CUT and 200 < len(rows) <= 300
    assert rows == made_rows(0, len(rows))["stamp_ns"].tolist()


def test_two_equal_runs_at_different_times_give_the_same_messages(tmp_path: Path) -> None:
    told = []
    for run in range(2):
        block = block_with_clock()
        block.counters["start_realtime_ns"] += run * 5_000_000_000
        rows = made_rows(0, 300)
        rows["state"][100:] = 4
        rows["stamp_ns"] += run * 1_234_567
        rows["compute_s"] += run * 1e-5
        status = {"state": "fault", "since_ns": run, "count": {"worst_late_s": run}}
        recorder = Recorder(block, tmp_path / str(run), "bench", reserve_bytes=0)
        recorder.begin()
        put(RowWriter(block), rows)
        block.write_status({**status, "reason": "x", "buses": {"can0": {"url": f"simbus:{run}"}}})
        recorder.remark("somebody came", client="panel")
        recorder.look()
        for late in range(3):  # changes of values that are left out cause no message
            block.write_status({**block.status(), "count": {"late": late + run}})
            recorder.look()
        recorder.finish()
        path = Path(recorder.status()["file"])
        topics = ("/cycle", "/status", "/description", "/events", "/timing")
        told.append({one: [value for _, value in stock_messages(path, one)] for one in topics})
    first, second = told
    assert first.pop("/timing") != second.pop("/timing")
    assert first == second and len(first["/status"]) == 1 and len(first["/events"]) == 4


def test_a_truncated_recording_is_read_up_to_the_cut(recorded: Path, tmp_path: Path) -> None:
    data = recorded.read_bytes()
    path = tmp_path / "cut.mcap"
    counts = []
    for part in range(1, 25):
        path.write_bytes(data[: len(data) * part // 24 - 1])
        reader = RecordingReader(path)
        cycles = [int(k) for columns in reader.cycles(["cycle"]) for k in columns["cycle"]]
        assert cycles == list(range(len(cycles)))
        assert reader.ended == CUT
        counts.append(len(cycles))
    assert counts == sorted(counts) and counts[-1] == 3000


def test_a_damaged_recording_is_read_up_to_the_damage(recorded: Path, tmp_path: Path) -> None:
    data = bytearray(recorded.read_bytes())
    middle = len(data) // 2
    data[middle : middle + 64] = os.urandom(64)
    path = tmp_path / "damaged.mcap"
    path.write_bytes(data)
    reader = RecordingReader(path)
    cycles = [int(k) for columns in reader.cycles(["cycle"]) for k in columns["cycle"]]
    assert reader.ended == CUT and cycles == list(range(len(cycles)))


def test_a_file_that_is_no_recording_is_reported(tmp_path: Path) -> None:
    other = tmp_path / "other.mcap"
    for data in (b"", b"not one", os.urandom(500)):
        other.write_bytes(data)
        with pytest.raises(RecordingError, match=r"other\.mcap: not a recording"):
            list(RecordingReader(other).cycles())
    os.mkfifo(tmp_path / "pipe.mcap")
    with pytest.raises(RecordingError, match=r"pipe\.mcap: is not a regular file"):
        list(RecordingReader(tmp_path / "pipe.mcap").cycles())
    with pytest.raises(RecordingError, match="No such file"):
        list(RecordingReader(tmp_path / "missing.mcap").cycles())


def _foreign(path: Path, profile: str, schema: bytes, data: bytes, **metadata: str) -> Path:
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile=profile)
        if metadata:
            writer.add_metadata("recording", metadata)
        schema_id = writer.register_schema("other", "protobuf", schema) if schema else 0
        channel = writer.register_channel("/cycle", "protobuf", schema_id)
        writer.add_message(channel, 0, data, 0)
        writer.finish()  # type: ignore[no-untyped-call]
    return path


def test_foreign_mcap_files_are_reported(tmp_path: Path) -> None:
    for schema in (b"", b"{}", b"\xff\xfe\x00"):
        for profile in ("", "ros2"):
            path = _foreign(tmp_path / "other.mcap", profile, schema, b"\xff", part="1")
            with pytest.raises(RecordingError, match="but not a recording of cdpr-rt"):
                list(RecordingReader(path).cycles())
    path = _foreign(tmp_path / "other.mcap", "cdpr-rt", b"{}", b"{}", part="one")
    with pytest.raises(RecordingError, match=r"other\.mcap: not a recording"):
        list(RecordingReader(path).cycles())
    path = _foreign(tmp_path / "other.mcap", "cdpr-rt", b"{}", b"{}")
    with pytest.raises(RecordingError, match=r"other\.mcap: not a recording"):
        list(RecordingReader(path).cycles())


def test_reading_a_corrupt_recording_ends_at_the_corruption(tmp_path: Path) -> None:
    known = {"part": "1", "start_realtime_ns": "1", "start_monotonic_ns": "1", "version": "9"}
    numbers = b'{"properties": {"time_s": {"type": "number"}, "stamp_ns": {"type": "integer"}}}'
    for schema, data in ((b"", b"{}"), (b"[]", b"{}"), (b"\xff", b"{}"), (numbers, b"no row")):
        reader = RecordingReader(_foreign(tmp_path / "x.mcap", "cdpr-rt", schema, data, **known))
        assert list(reader.cycles()) == [] and reader.ended == CUT
    path = _foreign(tmp_path / "x.mcap", "cdpr-rt", numbers, b"{}", **known)
    with pytest.raises(RecordingError, match="has no position_rad; recorded by version 9"):
        list(RecordingReader(path).cycles(["position_rad"]))


def test_damaged_length_fields_do_not_exhaust_memory(tmp_path: Path) -> None:
    data = bytearray(_recorded(tmp_path, 100).read_bytes())
    chunk = data.index(b"\x06", 8 + 9 + 20)
    path = tmp_path / "damaged.mcap"
    for at in range(chunk, chunk + 60):
        damaged = data.copy()
        damaged[at] ^= 0xFF
        path.write_bytes(damaged)
        try:
            list(RecordingReader(path).cycles(["cycle"]))
        except RecordingError:
            continue


def test_each_rotated_file_can_be_read_alone(tmp_path: Path) -> None:
    block = block_with_clock()
    recorder = Recorder(block, tmp_path, "bench", most_bytes=40_000, reserve_bytes=0)
    recorder.start()
    writer, written = RowWriter(block), 0
    while len(list(tmp_path.iterdir())) < 4:  # when the recorder rotates its files
        written = run_for(writer, 0.5, written)
    recorder.stop()
    paths = sorted(tmp_path.iterdir())
    assert len(paths) > 2
    assert [path.stem[-3:] for path in paths] == [f"{k:03d}" for k in range(1, len(paths) + 1)]
    assert stock_cycles(*paths) == list(range(written))
    for path in paths:
        assert stock_messages(path, "/description")[0][1] == DESCRIPTION
        assert stock_messages(path, "/status")[0][1]["state"] == "active"
        reader = RecordingReader(path)
        list(reader.cycles(["cycle"]))
        assert reader.ended == CLOSED
    assert recorder.status()["bytes"] == sum(path.stat().st_size for path in paths)


def test_lost_rows_are_counted(tmp_path: Path) -> None:
    block = block_with_clock(seconds=0.5)
    recorder = Recorder(block, tmp_path, "bench", reserve_bytes=0)
    put(RowWriter(block), made_rows(0, 2000))
    recorder.start()
    recorder.stop()
    told = recorder.status()
    assert told["lost_rows"] + told["rows"] == 2000 and told["lost_rows"] >= 1500
    path = Path(told["file"])
    assert stock_cycles(path) == list(range(told["lost_rows"], 2000))
    assert stock_messages(path, "/events")[-1][1]["lost_rows"] == told["lost_rows"]


def test_events_record_changes_with_their_reasons(tmp_path: Path) -> None:
    block = block_with_clock()
    recorder = Recorder(block, tmp_path, "bench", reserve_bytes=0)
    rows = made_rows(0, 100)
    rows["state"][:10] = 2
    rows["program"][20:] = 2
    rows["reaction"][30:50:2], rows["limit"][30:50:2] = Reaction.CLAMP, 4
    rows["reaction"][60:], rows["limit"][60:] = Reaction.QUICK_STOP, 7
    rows["limit_axis"][60:] = 1
    rows["state"][70:] = 4
    recorder.start()
    writer = RowWriter(block)
    put(writer, rows[:65])
    until(lambda: recorder.status()["rows"] == 65)
    block.write_status({"state": "fault", "reason": "right: 31 N below 40 N"})
    put(writer, rows[65:])
    until(lambda: recorder.status()["rows"] == 100)
    recorder.remark("stopped by somebody", client="panel", at=float("nan"), by=Path("x"))
    recorder.stop()
    events = [value for _, value in stock_messages(Path(recorder.status()["file"]), "/events")]
    assert [event["text"] for event in events] == [
        "state ready",
        "state active",
        "program jog",
        "quick stop by tension high of right",
        "state fault",
        "right: 31 N below 40 N",
        "stopped by somebody",
    ]
    assert [event.get("cycle") for event in events] == [0, 10, 20, 60, 70, None, None]
    assert events[-1]["client"] == "panel" and events[-1]["at"] is None


def test_an_operators_confirmation_is_recorded_once() -> None:
    rows = made_rows(0, 60)
    rows["stream_buttons"][10:20] = stream_buttons(clutch=True, confirmed=0)
    rows["stream_buttons"][20:40] = stream_buttons(clutch=False, confirmed=1)
    rows["stream_buttons"][40:] = stream_buttons(clutch=True, confirmed=3)  # number 2 was lost
    rows["reaction"][50:] = Reaction.HOLD
    watched = EventDetector()
    watched.of_rows(rows[:5])
    told = [event for some in (rows[5:30], rows[30:]) for event, _ in watched.of_rows(some)]
    assert [(event["cycle"], event["text"]) for event in told] == [
        (20, "the operator confirmed target number 1"),
        (40, "the operator confirmed target number 3"),
        (50, "hold"),
    ]
    assert confirmation(stream_buttons(clutch=True, confirmed=256)) == 1


def test_state_changes_without_cycles_are_recorded_as_events(tmp_path: Path) -> None:
    block = block_with_clock()
    recorder = Recorder(block, tmp_path, "bench", reserve_bytes=0)
    block.write_status({"state": "unconfigured", "reason": ""})
    recorder.begin()
    recorder.look()
    writer = RowWriter(block)
    put(writer, made_rows(0, 50))
    recorder.look()
    block.write_status({"state": "dead", "reason": "the loop has died: killed by signal 9"})
    recorder.look()
    recorder.finish()
    texts = [
        value["text"] for _, value in stock_messages(Path(recorder.status()["file"]), "/events")
    ]
    assert sorted(texts) == [
        "state active",
        "state dead",
        "state unconfigured",
        "the loop has died: killed by signal 9",
    ]

"""Reads recordings, complete or truncated: cycles as arrays, the other topics as tables of JSON."""

from __future__ import annotations

import os
import struct
from collections.abc import Collection, Iterator
from io import BytesIO
from pathlib import Path
from typing import IO, Any, Final

import numpy as np
import pyarrow as pa  # type: ignore[import-untyped]
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Footer, Header, Metadata, Schema
from mcap.stream_reader import StreamReader, get_chunk_data_stream
from numpy.typing import NDArray
from pyarrow import json as arrow_json
from zstandard import ZstdError, frame_content_size

from cdpr_profiles.bounded_input import open_regular, parse_json
from cdpr_profiles.errors import ProfileError, brief
from cdpr_rt.core.cycle_row import FIELDS
from cdpr_rt.service.recording_file import (
    CYCLE,
    DESCRIPTION,
    EVENTS,
    PROFILE,
    STATUS,
    TIMING,
    RecordingError,
)

Columns = dict[str, NDArray[Any]]
"""Fields of rows: (rows,) each, or (rows, axes); null is nan."""

_BROKEN: Final = (
    ProfileError,
    McapError,
    ZstdError,
    struct.error,
    ValueError,
    LookupError,
    TypeError,
    AttributeError,
    EOFError,
    MemoryError,  # raised because of a damaged length
    OverflowError,
)
_MOST_CHUNK_BYTES: Final = 1 << 24
"""Largest size of a chunk, compressed or not; the recorder closes a chunk at a quarter of this."""
_MOST_RATIO: Final = 1000
"""Largest ratio of uncompressed content to file size; rows that differ only in time reach 400."""
_LEAST_BYTES: Final = 1 << 26
"""Uncompressed content that a file of any size may have."""
_MOST_MESSAGE_BYTES: Final = 1 << 18
"""Largest size of a description, a status or an event."""
_MOST_EVENTS: Final = 100_000
_MOST_EVENT_BYTES: Final = 1 << 24
"""Largest size of all events."""
_MOST_STATES: Final = 64
_MOST_TIMINGS: Final = 100_000
_MOST_TIMING_BYTES: Final = 1 << 25
"""Largest size of timings whose rows have not been read yet."""
_MOST_CHANNELS: Final = 64
"""Largest number of channels and of schemas; a recording has five of each."""
_TYPES: Final = {"number": pa.float64(), "integer": pa.int64(), "boolean": pa.bool_()}
_ALWAYS: Final = ("time_s", "stamp_ns")

_RECORD_HEAD, _MESSAGE_HEAD = struct.Struct("<BQ"), struct.Struct("<HIQQ")
_CHUNK_TIMES: Final = struct.Struct("<QQ")
_MAGIC_BYTES: Final = 8
_MOST_HEADS: Final = 1_000_000
_PLACES: Final = {name: k for k, name in enumerate(FIELDS)}

CLOSED, KILLED, CUT = "closed", "not closed", "cut short"


class RecordingReader:
    """One recording file; `cycles` reads it, and all other attributes are known after that.

    Raises RecordingError if the file is missing or not a recording. Unreadable data count as the
    end of the file.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.metadata: dict[str, str] = {}
        self.part = 0
        """Number of the file in its session, from 1."""
        self.offset_ns = 0
        """Difference between time of day and stamp."""
        self.description: dict[str, Any] = {}
        """The last published description of the robot."""
        self.axes: list[str] = []
        """Names of the axes, if the description has them."""
        self.states: set[str] = set()
        """States that appear in statuses."""
        self.events: list[dict[str, Any]] = []
        """Events in the order of the file, each with `log_time_ns`, the time of day."""
        self.ended = CUT
        """`CLOSED`; `KILLED` if the writer could not write the index; `CUT` if the file is
        truncated."""
        self.position = 0
        """Bytes read so far."""
        self._timings: list[bytes] = []
        """Timing messages whose rows follow, because a chunk may end between a timing and its
        row."""
        self._held_bytes = self._event_bytes = 0

    def cycles(self, fields: Collection[str] | None = None) -> Iterator[Columns]:
        """Yield the rows in blocks of some hundred, with all fields or only `fields`."""
        channels: dict[int, Channel] = {}
        schemas: dict[int, Schema] = {}
        with self._open() as file:
            for chunk in self._chunks(file):
                try:
                    self._require_bounds(chunk)
                    columns = self._rows(chunk, channels, schemas, fields)
                except _BROKEN:
                    self.ended = CUT
                    return
                if columns:
                    yield columns

    def _open(self) -> IO[bytes]:
        try:
            return os.fdopen(open_regular(self.path), "rb")
        except ProfileError as error:
            raise RecordingError(str(error)) from None

    def _chunks(self, file: IO[bytes]) -> Iterator[Chunk]:
        """Yield the chunks; process the records between them."""
        stream = StreamReader(file, emit_chunks=True, record_size_limit=_MOST_CHUNK_BYTES)
        try:
            for record in stream.records:
                self.position = file.tell()
                if isinstance(record, Header) and record.profile != PROFILE:
                    raise RecordingError(
                        f"{self.path}: an MCAP file, but not a recording of {PROFILE}"
                    )
                if isinstance(record, Metadata) and record.name == "recording":
                    self._take_metadata(record.metadata)
                elif isinstance(record, Footer):
                    self.ended = CLOSED if record.summary_start else KILLED
                elif isinstance(record, Chunk) and self.metadata:
                    yield record
        except OSError as error:
            raise RecordingError(f"{self.path}: cannot be read: {error.strerror}") from None
        except _BROKEN as error:
            self.ended = CUT
            if not self.metadata:
                reason = str(error).partition(", invalid magic")[0] or "the file is empty"
                raise RecordingError(f"{self.path}: not a recording: {reason}") from None
        if not self.metadata:
            raise RecordingError(f"{self.path}: not a recording: it does not name its robot")

    def _require_bounds(self, chunk: Chunk) -> None:
        """Raise RecordingError if a chunk is larger than a recorder writes.

        Raises ValueError if its sizes disagree, because the library relies on the size in the
        compressed data.
        """
        size = max(chunk.uncompressed_size, len(chunk.data))
        if chunk.compression == "zstd":
            if frame_content_size(chunk.data) not in (-1, chunk.uncompressed_size):
                raise ValueError("sizes of a chunk disagree")
        elif chunk.compression:
            raise RecordingError(
                f"{self.path}: compressed by {brief(chunk.compression, 20)}; allowed: zstd"
            )
        if size > _MOST_CHUNK_BYTES:
            raise RecordingError(
                f"{self.path}: a chunk of {size} bytes; allowed: up to {_MOST_CHUNK_BYTES}"
            )
        self._held_bytes += size
        most = max(_LEAST_BYTES, _MOST_RATIO * self.position)
        if self._held_bytes > most:
            raise RecordingError(
                f"{self.path}: its first {self.position} bytes expand to more than {most}; "
                f"allowed: up to {_MOST_RATIO} times as many"
            )

    def _take_metadata(self, metadata: dict[str, str]) -> None:
        self.part = int(metadata["part"])
        self.offset_ns = int(metadata["start_realtime_ns"]) - int(metadata["start_monotonic_ns"])
        self.metadata = dict(metadata)

    def _rows(
        self,
        chunk: Chunk,
        channels: dict[int, Channel],
        schemas: dict[int, Schema],
        fields: Collection[str] | None,
    ) -> Columns:
        """Read one chunk; return the rows in it, if any."""
        rows: list[bytes] = []
        for record in _records(chunk):
            if isinstance(record, Schema):
                self._require_few("schemas", schemas, len(record.data))
                schemas[record.id] = record
            elif isinstance(record, Channel):
                texts = (record.topic, *record.metadata.keys(), *record.metadata.values())
                self._require_few("channels", channels, sum(map(len, texts)))
                channels[record.id] = record
            else:
                channel_id, log_time_ns, data = record
                topic = channels[channel_id].topic
                if topic in (CYCLE, TIMING):
                    (rows if topic == CYCLE else self._timings).append(data)
                else:
                    self._take(topic, log_time_ns, data)
        held_bytes = sum(map(len, self._timings[len(rows) :]))
        if len(self._timings) - len(rows) > _MOST_TIMINGS or held_bytes > _MOST_TIMING_BYTES:
            raise RecordingError(
                f"{self.path}: too many timings without rows; allowed: up to {_MOST_TIMINGS} "
                f"with up to {_MOST_TIMING_BYTES} bytes in total"
            )
        if not rows:
            return {}
        parts = {CYCLE: rows}
        topics = {channel.topic: channel.schema_id for channel in channels.values()}
        if TIMING in topics:  # earlier recordings have all fields in one topic
            parts[TIMING] = self._timings[: len(rows)]
            del self._timings[: len(rows)]
        known = {
            topic: parse_json(schemas[topics[topic]].data, "schema")["properties"]
            for topic in parts
        }
        for name in (*(fields or ()), *_ALWAYS):
            if not any(name in properties for properties in known.values()):
                version = self.metadata.get("version")
                raise RecordingError(f"{self.path}: has no {name}; recorded by version {version}")
        return _joined([(parts[topic], known[topic]) for topic in parts], fields)

    def _require_few(self, what: str, known: Collection[int], size: int) -> None:
        if len(known) >= _MOST_CHANNELS or size > _MOST_MESSAGE_BYTES:
            raise RecordingError(
                f"{self.path}: too many or too long {what}; allowed: up to {_MOST_CHANNELS}, each "
                f"of {_MOST_MESSAGE_BYTES} bytes"
            )

    def _take(self, topic: str, log_time_ns: int, data: bytes) -> None:
        if topic not in (DESCRIPTION, STATUS, EVENTS):
            return
        if (size := len(data)) > _MOST_MESSAGE_BYTES:
            raise RecordingError(
                f"{self.path}: {topic}: a message of {size} bytes; allowed: {_MOST_MESSAGE_BYTES}"
            )
        value: dict[str, Any] = parse_json(data, topic)
        if topic == DESCRIPTION:
            axes = enumerate(value.get("axes", []))
            self.axes = [str(axis.get("name") or k) for k, axis in axes]
            self.description = value
        elif topic == STATUS:
            if len(self.states) < _MOST_STATES:
                self.states.add(str(value.get("state"))[:_MOST_STATES])
        else:
            self._event_bytes += size
            if len(self.events) >= _MOST_EVENTS or self._event_bytes > _MOST_EVENT_BYTES:
                raise RecordingError(
                    f"{self.path}: too many events; allowed: up to {_MOST_EVENTS}, of "
                    f"{_MOST_EVENT_BYTES} bytes together"
                )
            self.events.append({"log_time_ns": log_time_ns, **value, "text": str(value["text"])})


def span_of(path: Path) -> tuple[int, int]:
    """Return the time of day of the first and of the last message, ns; both 0 without messages.

    Only the heads of the chunks are read. Raises ProfileError for a file that cannot be read.
    """
    first_ns = last_ns = 0
    with os.fdopen(open_regular(path, links=False), "rb") as file:
        file.seek(_MAGIC_BYTES)
        for _ in range(_MOST_HEADS):
            head = file.read(_RECORD_HEAD.size)
            if len(head) < _RECORD_HEAD.size:
                break
            opcode, length = _RECORD_HEAD.unpack(head)
            if opcode == Opcode.DATA_END:
                break
            if opcode == Opcode.CHUNK and len(times := file.read(_CHUNK_TIMES.size)) == 16:
                begin_ns, end_ns = _CHUNK_TIMES.unpack(times)
                first_ns, last_ns = first_ns or begin_ns, max(last_ns, end_ns)
                length -= _CHUNK_TIMES.size
            if length > 1 << 62:  # a damaged file
                break
            file.seek(length, os.SEEK_CUR)
    return first_ns, last_ns


def _records(chunk: Chunk) -> Iterator[Schema | Channel | tuple[int, int, bytes]]:
    """Yield the schemas and channels of a chunk, and its messages as (channel, log time, data).

    The library's own parser needs three times as long for the messages. Raises one of `_BROKEN`.
    """
    stream, size = get_chunk_data_stream(chunk, validate_crc=True)
    content, end = stream.read(size), 0
    while end < size:
        opcode, length = _RECORD_HEAD.unpack_from(content, end)
        begin = end + _RECORD_HEAD.size
        end = begin + length
        data = content[begin:end]
        if len(data) < length:
            raise EOFError
        if opcode == Opcode.MESSAGE:
            channel_id, _, log_time_ns, _ = _MESSAGE_HEAD.unpack_from(data)
            yield channel_id, log_time_ns, data[_MESSAGE_HEAD.size :]
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            kind = Schema if opcode == Opcode.SCHEMA else Channel
            yield kind.read(ReadDataStream(BytesIO(data)))


def _joined(
    parts: list[tuple[list[bytes], dict[str, Any]]], fields: Collection[str] | None
) -> Columns:
    """Return the columns of all parts of the same rows; raises ValueError if rows differ."""
    wanted = None if fields is None else {*fields, "cycle"}
    joined = _columns(*parts[0], wanted)
    for messages, properties in parts[1:]:
        if wanted is None or wanted & (properties.keys() - {"cycle"}):
            columns = _columns(messages, properties, wanted)
            if not np.array_equal(joined["cycle"], columns["cycle"]):
                raise ValueError("rows and their timing belong to different cycles")
            joined |= columns
    names = sorted(joined, key=lambda name: _PLACES.get(name, len(_PLACES)))
    return {name: joined[name] for name in names if fields is None or name in fields}


def _columns(
    rows: list[bytes], properties: dict[str, Any], fields: Collection[str] | None
) -> Columns:
    wanted = [name for name in properties if fields is None or name in fields]
    types, widths = [], {}
    for name in wanted:
        one = properties[name]
        is_array = one["type"] == "array"
        kind = _TYPES[(one["items"] if is_array else one)["type"]]
        types.append((name, pa.list_(kind) if is_array else kind))
        widths[name] = one["minItems"] if is_array else 0
    text = b"\n".join(rows)
    if len(rows) * sum(max(width, 1) for width in widths.values()) > len(text):
        raise ValueError("rows do not fit their schema")
    table = arrow_json.read_json(
        pa.BufferReader(text),
        read_options=arrow_json.ReadOptions(use_threads=False, block_size=len(text) + 1),
        parse_options=arrow_json.ParseOptions(
            explicit_schema=pa.schema(types), unexpected_field_behavior="ignore"
        ),
    )
    columns: Columns = {}
    for name in wanted:
        values = table[name].combine_chunks()
        if widths[name]:
            values = values.flatten()
        array = values.to_numpy(zero_copy_only=False)
        columns[name] = array.reshape(len(rows), -1) if widths[name] else array
    return columns

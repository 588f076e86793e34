"""Small files that expand to much data are rejected with their bound and little memory."""

from __future__ import annotations

import json
import os
import struct
import subprocess
import sys
import zlib
from collections.abc import Callable
from pathlib import Path

import pytest
import zstandard
from mcap.writer import CompressionType, Writer

from cdpr_rt.service.recording_file import EVENTS, PROFILE, TIMING

BEYOND_BYTES = 1 << 29
"""Memory that a reader may take beyond the loaded modules."""
READERS = """
import resource, sys
from importlib import import_module
from pathlib import Path
import numpy as np

def path():
    from cdpr_rt.motion.path_description import Coordinates
    from cdpr_rt.motion.gcode import GcodeSettings
    from cdpr_rt.motion.path_nodes import nodes_of
    from cdpr_rt.motion.way_points import read_path

    named = Coordinates(("x", "y", "z"), np.zeros(3))
    settings = GcodeSettings(np.zeros(3))
    return lambda file: nodes_of(read_path(file, named, settings), np.ones(3))

def recording():
    from cdpr_rt.service.recording_reader import RecordingReader

    return lambda file: list(RecordingReader(file).cycles())

def from_module(name, reader):
    return lambda: getattr(import_module(name), reader)

# each reader loads what it needs, and only that
reader = {
    ".eds": from_module("cdpr_profiles.eds", "load_dictionary"),
    ".nc": path,
    ".csv": path,
    ".png": from_module("cdpr_drivers.camera.folder_camera", "decoded_image"),
    ".json": from_module("cdpr_rt.calibration.readings", "load_data"),
    ".mcap": recording,
}[Path(sys.argv[1]).suffix]()
taken = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (taken + int(sys.argv[2]),) * 2)
try:
    reader(Path(sys.argv[1]))
except Exception as error:
    print(type(error).__name__, error)
"""


def sheet(path: Path, *sections: str) -> None:
    device = "[1000]\nParameterName=a\nDataType=7\n[1018]\nParameterName=a\nDataType=7\n"
    path.write_text("[DeviceInfo]\n" + device + "\n".join(sections))


def compact_arrays(path: Path) -> None:
    keys = "ParameterName=a\nObjectType=0x8\nDataType=5\nAccessType=rw\nCompactSubObj=254\n"
    sheet(path, *(f"[{0x2000 + k:04X}]\n{keys}" for k in range(2700)))


def full_circles(path: Path) -> None:
    path.write_text("G21 G90\nG0 X0 Y0 Z0\nG1 F1000\nG2 I99\n" + "I99\n" * 20_000 + "M2\n")


def empty_lines(path: Path) -> None:
    path.write_text("\n" * 1_100_000 + "M2\n")


def long_cell(path: Path) -> None:
    path.write_text(f"x_m,y_m,z_m\n0,0,0\n{'9' * 120_000},0,0\n")


def many_pixels(path: Path) -> None:
    def part(kind: bytes, data: bytes) -> bytes:
        return (
            struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        )

    head = struct.pack(">IIBBBBB", 32_000, 32_000, 8, 0, 0, 0, 0)
    row = zlib.compress(bytes(32_001))
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + part(b"IHDR", head) + part(b"IDAT", row))


def pipe(path: Path) -> None:
    os.mkfifo(path)


def endless_device(path: Path) -> None:
    path.symlink_to("/dev/zero")


def many_values(path: Path) -> None:
    path.write_text('{"poses": [' + "[]," * 600_000 + "[]]}")


def recording(path: Path, fill: Callable[[Writer], None], tail: bytes = b"") -> None:
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=1 << 20, compression=CompressionType.ZSTD)
        writer.start(PROFILE, "a test")
        about = {"part": "1", "start_realtime_ns": "0", "start_monotonic_ns": "0"}
        writer.add_metadata("recording", about)
        fill(writer)
        file.write(tail)


def large_chunk(path: Path) -> None:
    size = 1 << 30
    packer = zstandard.ZstdCompressor().compressobj(size=size)
    packed = b"".join(packer.compress(bytes(1 << 20)) for _ in range(size >> 20)) + packer.flush()
    chunk = struct.pack("<QQQII4sQ", 0, 0, size, 0, 4, b"zstd", len(packed)) + packed
    recording(path, lambda _: None, struct.pack("<BQ", 6, len(chunk)) + chunk)


def many_events(path: Path) -> None:
    def fill(writer: Writer) -> None:
        schema = writer.register_schema("event", "jsonschema", b"{}")
        channel = writer.register_channel(EVENTS, "json", schema)
        for k in range(110_000):
            writer.add_message(channel, k, b'{"text": "again"}', k)
        writer.finish()

    recording(path, fill)


def long_event(path: Path) -> None:
    def fill(writer: Writer) -> None:
        schema = writer.register_schema("event", "jsonschema", b"{}")
        channel = writer.register_channel(EVENTS, "json", schema)
        writer.add_message(channel, 0, json.dumps({"text": "x" * 900_000}).encode(), 0)
        writer.finish()

    recording(path, fill)


def timings_alone(path: Path) -> None:
    def fill(writer: Writer) -> None:
        schema = writer.register_schema("timing", "jsonschema", b"{}")
        channel = writer.register_channel(TIMING, "json", schema)
        for k in range(600):
            writer.add_message(channel, k, b" " * 1_000_000, k)
        writer.finish()

    recording(path, fill)


def many_schemas(path: Path) -> None:
    def fill(writer: Writer) -> None:
        for k in range(600):
            schema = writer.register_schema(f"timing {k}", "jsonschema", b" " * 200_000)
            channel = writer.register_channel(f"other {k}", "json", schema)
            writer.add_message(channel, k, b"{}", k)
        writer.finish()

    recording(path, fill)


@pytest.mark.parametrize(
    ("name", "write", "bound"),
    [
        ("a.eds", compact_arrays, "objects; allowed: up to 20000"),
        ("c.nc", full_circles, "nodes; allowed: 1000000; divide the file"),
        ("d.nc", empty_lines, "the file has more than"),
        ("e.csv", long_cell, "...; allowed: -1e+06 to 1e+06"),
        ("f.png", many_pixels, "too many pixels; allowed: up to 120000000"),
        ("g.png", pipe, "is not a regular file"),
        ("h.png", endless_device, "is not a regular file"),
        ("i.json", many_values, "too many keys and values; allowed: 500000"),
        ("j.mcap", large_chunk, "a chunk of 1073741824 bytes; allowed: up to 16777216"),
        ("k.mcap", many_events, "too many events; allowed: up to 100000"),
        ("l.mcap", long_event, "bytes; allowed: 262144"),
        ("m.mcap", timings_alone, "timings without rows; allowed: up to 100000"),
        ("n.mcap", many_schemas, "too many or too long schemas; allowed: up to 64"),
    ],
    ids=lambda value: value.__name__ if callable(value) else None,
)
def test_a_file_that_expands_to_too_much_is_rejected_with_little_memory(
    tmp_path: Path, name: str, write: Callable[[Path], None], bound: str
) -> None:
    write(tmp_path / name)
    arguments = [sys.executable, "-c", READERS, tmp_path / name, str(BEYOND_BYTES)]
    told = subprocess.run(arguments, capture_output=True, text=True, timeout=300.0, check=True)
    assert bound in told.stdout, told.stdout + told.stderr
    assert "MemoryError" not in told.stdout and len(told.stdout) < 500

"""One file of a recording: an MCAP file that is complete after each synchronisation."""

from __future__ import annotations

import os
import struct
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from foxglove import Context, open_mcap
from foxglove.mcap import MCAPCompression, MCAPWriteOptions

from cdpr_rt.core.cycle_row import FIELDS, WALL_TIMES, cycle_dtype
from cdpr_rt.errors import ControlError
from cdpr_rt.state_file import FILE_MODE, make_private_folder

PROFILE: Final = "cdpr-rt"
"""The MCAP profile, which identifies a file as a recording."""
_MAGIC: Final = b"\x89MCAP0\r\n"
_CHUNK_BYTES: Final = 1 << 22
"""Largest chunk in a file with much data; readers keep a whole chunk in memory."""
_DATA_END: Final = struct.pack("<BQI", 0x0F, 4, 0)
_FOOTER_WITHOUT_SUMMARY: Final = struct.pack("<BQQQI", 0x02, 20, 0, 0, 0)
END: Final = _DATA_END + _FOOTER_WITHOUT_SUMMARY + _MAGIC
"""End of a file without an index; readers then read the file from the beginning."""


class RecordingError(ControlError):
    """The recording cannot continue; the message gives the file and the reason."""


class NameTakenError(RecordingError):
    """A file of this name exists already."""


class _Held:
    """Buffer that the MCAP writer writes to; writing never fails.

    So the library never sees a disk error, which it could not report.
    """

    def __init__(self) -> None:
        self.data = bytearray()
        self._at = 0

    def write(self, data: bytes | bytearray) -> int:
        """Append data to the buffer."""
        self.data += data
        self._at += len(data)
        return len(data)

    def seek(self, offset: int, whence: int = 0) -> int:
        """Return the position; the writer is configured not to move it."""
        if (offset, whence) not in ((0, os.SEEK_CUR), (self._at, os.SEEK_SET)):
            raise OSError(f"cannot seek to {offset}, {whence}")
        return self._at

    def flush(self) -> None:
        """Do nothing, because `RecordingFile` synchronises the file."""


class RecordingFile:
    """A new MCAP file at `path`; messages logged in `context` go into it.

    `sync` appends new data, ends the file as MCAP requires and waits for the disk to confirm it.
    The data that replace the previous end of the file are written last. So after a kill or a power
    loss at any time, a reader finds a valid end and all data before it. Raises RecordingError if
    the disk fails; the file is then in the state of the last `sync`, and closed.
    """

    def __init__(self, path: Path, context: Context, metadata: dict[str, str]) -> None:
        self.path = path
        self._held = _Held()
        try:
            make_private_folder(path.parent)
        except OSError as error:
            raise RecordingError(f"{path}: cannot record: {error.strerror}") from error
        try:
            flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC
            self._fd = os.open(path, flags, FILE_MODE)
        except FileExistsError as error:
            raise NameTakenError(f"{path}: cannot record: {error.strerror}") from error
        except OSError as error:
            raise RecordingError(f"{path}: cannot record: {error.strerror}") from error
        self.size = 0
        """Number of bytes that are safe on the disk, without the end of the file."""
        options = MCAPWriteOptions(
            compression=MCAPCompression.Zstd,
            compression_level=1,
            compression_threads=0,
            chunk_size=_CHUNK_BYTES,
            disable_seeking=True,
            calculate_data_section_crc=False,
            profile=PROFILE,
        )
        self._writer = open_mcap(self._held, context=context, writer_options=options)
        self._writer.write_metadata("recording", metadata)
        self.sync()
        _sync_folder(path.parent)

    @property
    def is_there(self) -> bool:
        """Whether the file still has a name."""
        return os.fstat(self._fd).st_nlink > 0

    def free_space(self) -> tuple[int, int]:
        """Return the number of free bytes on the file's disk, and of all its bytes."""
        usage = os.fstatvfs(self._fd)
        return usage.f_bavail * usage.f_frsize, usage.f_blocks * usage.f_frsize

    def sync(self) -> None:
        """Write all data logged so far to the disk."""
        self._writer.flush()
        if self._held.data:
            self._put(END)

    def close(self) -> None:
        """Write the index and close the file, once; nothing can be logged afterwards."""
        if self._fd < 0:
            return
        self.sync()
        self._writer.close()
        self._put(b"")
        self._close()

    def _close(self) -> None:
        fd, self._fd = self._fd, -1
        os.close(fd)

    def _put(self, end: bytes) -> None:
        data = bytes(self._held.data)
        self._held.data.clear()
        held = len(END) if self.size else 0
        text = data + end
        try:
            _write_safely(self._fd, text[held:], self.size + held)
            if held:
                _write_safely(self._fd, text[:held], self.size)
        except OSError as error:
            self._give_up()
            raise RecordingError(f"{self.path}: recording ended: {error.strerror}") from error
        self.size += len(data)

    def _give_up(self) -> None:
        """Restore the data of the last `sync`, and their end."""
        try:
            if self.size:
                _write_all(self._fd, END, self.size)
                os.ftruncate(self._fd, self.size + len(END))
            else:
                self.path.unlink(missing_ok=True)
        except OSError:
            pass  # a reader that accepts truncated files can still read it
        finally:
            self._close()
            self._writer.close()
            self._held.data.clear()


def _sync_folder(folder: Path) -> None:
    """Write the file names in a folder to the disk; some file systems do not support this."""
    with suppress(OSError):
        fd = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(fd)
        finally:
            os.close(fd)


def _write_safely(fd: int, data: bytes, at: int) -> None:
    _write_all(fd, data, at)
    os.fdatasync(fd)


def _write_all(fd: int, data: bytes, at: int) -> None:
    view = memoryview(data)
    while view:
        written = os.pwrite(fd, view, at)
        at += written
        view = view[written:]


# JSON schema of each topic of a recording.

CYCLE, TIMING, STATUS, DESCRIPTION, EVENTS = (
    "/cycle", "/timing", "/status", "/description", "/events"
)  # fmt: skip
CYCLE_FIELDS: Final = tuple(name for name in FIELDS if name not in WALL_TIMES)
TIMING_FIELDS: Final = ("cycle", *WALL_TIMES)

_TYPES = {"f": "number", "i": "integer", "u": "integer", "b": "boolean"}
_KNOWN_OR_NOT = {"type": ["number", "null"]}


def cycle_schema(n: int) -> dict[str, Any]:
    """Return the schema of a row for n axes, without fields that depend on wall-clock time."""
    about = "One cycle of the control loop; arrays over the axes, in SI units"
    return _row_schema("Cycle", about, CYCLE_FIELDS, n)


def timing_schema() -> dict[str, Any]:
    """Return the schema of a row's fields that depend on wall-clock time."""
    about = "When a cycle of the control loop ran, and how long it took, by wall-clock time"
    return _row_schema("Timing", about, TIMING_FIELDS, 1)


def _row_schema(title: str, about: str, names: Sequence[str], n: int) -> dict[str, Any]:
    """Return the schema of the fields `names` of a row for n axes.

    Numbers may be null, but viewers do not understand this in a schema. So each number has a plain
    `type` next to `$ref`: viewers read it, and validators of this draft have to ignore it.
    """
    dtype = cycle_dtype(n)
    properties: dict[str, Any] = {}
    for name in names:
        one: dict[str, Any] = {"type": _TYPES[dtype[name].base.kind]}
        if one["type"] == "number":
            one["$ref"] = "#/definitions/known_or_not"
        shape = dtype[name].shape
        if shape:
            one = {"type": "array", "items": one, "minItems": shape[0], "maxItems": shape[0]}
        properties[name] = {**one, "description": FIELDS[name].meaning}
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": f"cdpr_rt.{title}",
        "description": about,
        "type": "object",
        "definitions": {"known_or_not": _KNOWN_OR_NOT},
        "properties": properties,
        "required": list(properties),
        "additionalProperties": False,
    }


def _text_schema(title: str, description: str, **properties: str) -> dict[str, Any]:
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": f"cdpr_rt.{title}",
        "description": description,
        "type": "object",
        "properties": {name: {"type": kind} for name, kind in properties.items()},
    }


STATUS_SCHEMA: Final = _text_schema(
    "Status",
    "State, program, reasons and notices of the loop, each time one of them changes",
    state="string",
    program="string",
    reason="string",
    read_only="boolean",
    lockstep="boolean",
)
DESCRIPTION_SCHEMA: Final = _text_schema(
    "Description",
    "The robot, its axes, limits and programs, as they were while this file was recorded",
    robot="string",
    period_s="number",
    version="string",
)
EVENT_SCHEMA: Final = _text_schema(
    "Event",
    "A change of state, program or reaction as seen in the rows, or a remark of the service",
    text="string",
    cycle="integer",
    time_s="number",
)

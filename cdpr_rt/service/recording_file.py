"""One file of a recording: an MCAP that is whole each time it has been synchronised."""

from __future__ import annotations

import os
import struct
from pathlib import Path
from typing import Final

from foxglove import Context, open_mcap
from foxglove.mcap import MCAPCompression, MCAPWriteOptions

from cdpr_rt.errors import ControlError

_MAGIC: Final = b"\x89MCAP0\r\n"
_DATA_END: Final = struct.pack("<BQI", 0x0F, 4, 0)
_FOOTER_WITHOUT_SUMMARY: Final = struct.pack("<BQQQI", 0x02, 20, 0, 0, 0)
_END: Final = _DATA_END + _FOOTER_WITHOUT_SUMMARY + _MAGIC
"""What ends a file that has no index; readers then go through it from the beginning."""


class RecordingError(ControlError):
    """The recording cannot go on; the message names the file and says why."""


class _Held:
    """What the MCAP writer writes to: keeps it until it is wanted, never fails.

    So no error of the disk can reach the library, which has no way to report one.
    """

    def __init__(self) -> None:
        self.data = bytearray()
        self._at = 0

    def write(self, data: bytes | bytearray) -> int:
        """Append."""
        self.data += data
        self._at += len(data)
        return len(data)

    def seek(self, offset: int, whence: int = 0) -> int:
        """Return the position; the writer was told not to move it."""
        if (offset, whence) not in ((0, os.SEEK_CUR), (self._at, os.SEEK_SET)):
            raise OSError(f"cannot seek to {offset}, {whence}")
        return self._at

    def flush(self) -> None:
        """Do nothing: the file is synchronised by its owner."""


class RecordingFile:
    """A new MCAP file at `path`; what is logged in `context` goes into it.

    `sync` appends what came since, ends the file as MCAP asks and has the disk confirm it. The
    next one writes over that end, so a reader finds a whole file whenever the writer was killed.
    Raises RecordingError where the disk does not take it; the file is then what it was at the
    last `sync`, and closed.
    """

    def __init__(self, path: Path, context: Context, metadata: dict[str, str]) -> None:
        self.path = path
        self._held = _Held()
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._fd = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o644)
        except OSError as error:
            raise RecordingError(f"{path}: cannot record: {error.strerror}") from error
        self.size = 0
        """Bytes that are safe, without the file's end."""
        options = MCAPWriteOptions(
            compression=MCAPCompression.Zstd,
            compression_level=1,
            compression_threads=0,
            chunk_size=None,
            disable_seeking=True,
            calculate_data_section_crc=False,
            profile="cdpr-rt",
        )
        self._writer = open_mcap(self._held, context=context, writer_options=options)
        self._writer.write_metadata("recording", metadata)
        self.sync()
        _sync_folder(path.parent)

    @property
    def name(self) -> str:
        """The file's name without its folder."""
        return self.path.name

    def sync(self) -> None:
        """Make everything logged so far safe."""
        self._writer.flush()
        self._put(_END)

    def close(self) -> None:
        """Write the index and close; nothing is logged into it afterwards."""
        self._writer.close()
        self._put(b"")
        os.ftruncate(self._fd, self.size)
        os.fsync(self._fd)
        os.close(self._fd)

    def _put(self, end: bytes) -> None:
        data = bytes(self._held.data)
        self._held.data.clear()
        try:
            _write_all(self._fd, data + end, self.size)
            os.fsync(self._fd)
        except OSError as error:
            self._give_up()
            raise RecordingError(f"{self.path}: recording ended: {error.strerror}") from error
        self.size += len(data)

    def _give_up(self) -> None:
        """Leave what was safe before; its end fits where it was."""
        try:
            os.ftruncate(self._fd, self.size)
            _write_all(self._fd, _END if self.size else b"", self.size)
        except OSError:
            pass  # a reader that allows for a file cut short still reads it
        finally:
            os.close(self._fd)
            if self.size == 0:
                self.path.unlink(missing_ok=True)
            self._writer.close()
            self._held.data.clear()


def _sync_folder(folder: Path) -> None:
    """Make the names of the files in it safe."""
    fd = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    os.fsync(fd)
    os.close(fd)


def _write_all(fd: int, data: bytes, at: int) -> None:
    view = memoryview(data)
    while view:
        written = os.pwrite(fd, view, at)
        at += written
        view = view[written:]

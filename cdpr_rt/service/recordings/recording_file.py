"""One file of a recording: an MCAP that is whole each time it has been synchronised."""

from __future__ import annotations

import os
import struct
from contextlib import suppress
from pathlib import Path
from typing import Final

from foxglove import Context, open_mcap
from foxglove.mcap import MCAPCompression, MCAPWriteOptions

from cdpr_rt.errors import ControlError
from cdpr_rt.private_files import FILE_MODE, make_private_folder

PROFILE: Final = "cdpr-rt"
"""The MCAP profile: what says that a file is a recording."""
_MAGIC: Final = b"\x89MCAP0\r\n"
_CHUNK_BYTES: Final = 1 << 22
"""At most, where much has come at once; readers hold a whole chunk in memory."""
_DATA_END: Final = struct.pack("<BQI", 0x0F, 4, 0)
_FOOTER_WITHOUT_SUMMARY: Final = struct.pack("<BQQQI", 0x02, 20, 0, 0, 0)
_END: Final = _DATA_END + _FOOTER_WITHOUT_SUMMARY + _MAGIC
"""End of a file without an index; readers then go through it from the beginning."""


class RecordingError(ControlError):
    """The recording cannot go on; the message names the file and says why."""


class NameTakenError(RecordingError):
    """There is a file of this name already."""


class _Held:
    """Buffer that the MCAP writer writes to; never fails.

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

    `sync` appends what came since, ends the file as MCAP asks and has the disk confirm it. What
    belongs where the end was before is written last, so a reader finds an end, and everything that
    belongs to it, whenever the writer was killed or the power was cut. Raises RecordingError where
    the disk does not take it; the file is then what it was at the last `sync`, and closed.
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
        """Bytes that are safe, without the file's end."""
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
        """Whether the file can still be found by somebody."""
        return os.fstat(self._fd).st_nlink > 0

    def free_space(self) -> tuple[int, int]:
        """Return the bytes that are free on its disk, and how many the disk has."""
        usage = os.fstatvfs(self._fd)
        return usage.f_bavail * usage.f_frsize, usage.f_blocks * usage.f_frsize

    def sync(self) -> None:
        """Make everything logged so far safe."""
        self._writer.flush()
        if self._held.data:
            self._put(_END)

    def close(self) -> None:
        """Write the index and close, once; nothing is logged into it afterwards."""
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
        held = len(_END) if self.size else 0
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
        """Leave what was safe before, and its end."""
        try:
            if self.size:
                _write_all(self._fd, _END, self.size)
                os.ftruncate(self._fd, self.size + len(_END))
            else:
                self.path.unlink(missing_ok=True)
        except OSError:
            pass  # a reader that allows for a file cut short still reads it
        finally:
            self._close()
            self._writer.close()
            self._held.data.clear()


def _sync_folder(folder: Path) -> None:
    """Make the names of the files in it safe; some file systems know no such thing."""
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

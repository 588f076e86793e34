"""A robot's recordings: their list, and the process that reads one of them.

Reading a recording takes seconds, so the service does not do it. Only the names in the list can be
requested, so a request cannot name any other file.
"""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from cdpr_profiles.errors import ProfileError, brief
from cdpr_rt.errors import ControlError
from cdpr_rt.service.recording import file_name_of
from cdpr_rt.service.recording_reader import span_of
from cdpr_rt.service.retention import recordings_of

_PIECE_BYTES: Final = 1 << 17
_MOST_READERS: Final = 2
"""Largest number of recordings that are read at the same time for curves, and for anything else.

A slow download therefore blocks no plot.
"""
READING_S: Final = 600.0
"""Longest time for reading one of them."""
_TOLD_S: Final = 1.0
_MOST_TEXT: Final = 500


class RecordingsBusyError(ControlError):
    """Too many recordings are being read."""


class RecordingFolder:
    """The recordings of one robot in a folder.

    `command` is a command line that reads one of them. Its arguments are the kind of the output
    (`csv`, `columns`, `picture`), the file, fields separated by commas or "", begin and end in s,
    and the number of points. It writes the output, or the reason of its failure to standard error.
    """

    def __init__(self, folder: Path, robot: str, command: Sequence[str]) -> None:
        self._folder, self._robot = folder, file_name_of(robot)
        self._command = command
        self._spans: dict[tuple[str, int, float], tuple[int, int]] = {}
        self._readers = Counter[bool]()
        """Number of processes that read, for curves (True) and for anything else."""

    def find(self, name: str) -> Path | None:
        """Return the recording of this name, None if the list does not contain it."""
        found = (path for path, _, _ in recordings_of(self._folder, self._robot))
        return next((path for path in found if path.name == name), None)

    def listed(self, live: str | None) -> list[dict[str, Any]]:
        """Return the recordings, newest first, as `models.Recording`; `live` is the open file."""
        found = sorted(recordings_of(self._folder, self._robot), key=lambda one: one[0].name)
        spans: dict[tuple[str, int, float], tuple[int, int]] = {}
        listed = []
        for path, written_s, size in reversed(found):
            is_live = str(path) == live
            # the time of the last write shows how long the open file is, without reading it
            key = (path.name, 0, 0.0) if is_live else (path.name, size, written_s)
            with suppress(ProfileError, OSError, ValueError):  # removed meanwhile, or damaged
                first_ns, last_ns = self._spans.get(key) or span_of(path)
                if first_ns:  # otherwise it contains nothing yet
                    spans[key] = first_ns, last_ns
                last_ns = max(last_ns, int(written_s * 1e9)) if is_live else last_ns
                first_ns = first_ns or last_ns or int(written_s * 1e9)
                last_ns = max(first_ns, last_ns)
                begin = datetime.fromtimestamp(first_ns * 1e-9, UTC).isoformat("T", "seconds")
                one = {"begin": begin, "duration_s": (last_ns - first_ns) * 1e-9, "bytes": size}
                session, _, part = path.stem.rpartition("-")
                listed.append({"name": path.name, "session": session, "part": int(part), **one})
                listed[-1]["live"] = is_live
        self._spans = spans  # at the end, because several threads may list at the same time
        return listed

    async def read(
        self, waiting: Callable[[], Awaitable[None]], *arguments: str
    ) -> AsyncIterator[bytes]:
        """Yield the output of the process that reads a recording.

        Until it comes, `waiting` is awaited every second; its exception ends the process.
        Raises RecordingsBusyError, and ValueError with its reason if it fails before any output.
        """
        if self._readers[curves := arguments[0] == "columns"] >= _MOST_READERS:
            raise RecordingsBusyError(
                f"{_MOST_READERS} recordings are already being read; try again later"
            )
        self._readers[curves] += 1
        process = None
        try:
            process = await asyncio.create_subprocess_exec(
                *self._command, *arguments, stdin=asyncio.subprocess.DEVNULL,
                stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.PIPE,
            )  # fmt: skip
            async with asyncio.timeout(READING_S):
                async for piece in _pieces_of(process, waiting):
                    yield piece
        finally:
            self._readers[curves] -= 1
            if process is not None and process.returncode is None:
                process.kill()


async def _pieces_of(
    process: asyncio.subprocess.Process, waiting: Callable[[], Awaitable[None]]
) -> AsyncIterator[bytes]:
    assert process.stdout is not None
    assert process.stderr is not None
    any_output = False
    while True:
        reading = asyncio.ensure_future(process.stdout.read(_PIECE_BYTES))
        while not (await asyncio.wait({reading}, timeout=_TOLD_S))[0]:
            await waiting()
        if not (piece := reading.result()):
            break
        any_output = True
        yield piece
    text = (await process.stderr.read(_MOST_TEXT)).decode("utf-8", "replace").strip()
    if await process.wait():
        # after the first output only the end of the connection can show the failure
        unknown = "out of memory? choose fewer fields or a shorter time"
        why = brief(text.splitlines()[-1] if text else unknown, _MOST_TEXT)
        raise ValueError(why) if not any_output else ConnectionError(why)

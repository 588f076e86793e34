"""Frames as ports take and give them, and the files this process holds."""

from __future__ import annotations

import contextlib
from pathlib import Path

from cdpr_drivers.bus.frames import FRAME, FramePort


def frame(can_id: int, data: bytes = b"") -> bytes:
    return FRAME.pack(can_id, len(data), data)


def receive(port: FramePort) -> bytes:
    buffer = bytearray(16)
    assert port.recv_into(buffer) == 16
    return bytes(buffer)


def open_files() -> list[str]:
    names = []
    for entry in Path("/proc/self/fd").iterdir():
        with contextlib.suppress(FileNotFoundError):  # the folder's own
            names.append(str(entry.readlink()))
    return names

"""Packed frames, the open files of this process, and a socketcand server."""

from __future__ import annotations

import contextlib
import socket
import threading
from pathlib import Path

from cdpr_drivers.bus import BusUrl
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
        with contextlib.suppress(FileNotFoundError):  # the descriptor of the folder itself
            names.append(str(entry.readlink()))
    return names


class Server:
    """A socketcand server that sends the pieces of text that a test gives it."""

    def __init__(self, *greeting: bytes) -> None:
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.heard = b""
        self.client: socket.socket
        self._greeting = greeting
        self.serve()

    def serve(self) -> None:
        """Greet one client."""
        self._thread = threading.Thread(target=self._greet, daemon=True)
        self._thread.start()

    @property
    def url(self) -> BusUrl:
        return BusUrl.parse(f"socketcand://127.0.0.1:{self.listener.getsockname()[1]}/can0")

    def _greet(self) -> None:
        self.client, _ = self.listener.accept()
        for text in self._greeting:
            self.client.sendall(text)
            if text != self._greeting[-1]:
                self.heard += self.client.recv(4096)

    def close(self) -> None:
        self.listener.close()
        self._thread.join(60.0)
        self.client.close()


GREETING = (b"< hi >", b"< ok >", b"< ok >")

"""Serves a simulated camera on a Unix socket, in a process of its own beside the bus.

A client sends lines of JSON and gets one line of JSON for each:

    {"do": "about"}   {"width": 1280, "height": 1024}
    {"do": "grab"}    {"width": 1280, "height": 1024, "time_s": 12.5, "number": 3, "bytes": 1310720}
                      and so many bytes after it: grey levels, row by row
    anything else     {"error": "..."}

A client is hung up on while the camera is unplugged by its plant. `time_s` is bus time in the
middle of the exposure.
"""

from __future__ import annotations

import json
import os
import selectors
import signal
import socket
import sys
from collections.abc import Callable
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

from cdpr_sim_bus.camera.sim_camera import SimCamera
from cdpr_sim_bus.errors import BusSetupError
from cdpr_sim_bus.physics_board import BoardPlatform

_MOST_REQUEST = 4096
_FAULTS = "dark, defocus PIXELS, mend, unplug"


class CameraServer:
    """Answers clients until SIGTERM, SIGINT or `unplug`; one request at a time.

    Lines on standard input break and mend things: `dark`, `defocus 6`, `mend`, `unplug`; each is
    answered by a line of JSON on standard output.
    """

    def __init__(self, camera: SimCamera, platform: BoardPlatform, path: Path) -> None:
        self._camera, self._platform, self._path = camera, platform, path
        self._selector = selectors.DefaultSelector()
        self._clients: dict[socket.socket, bytearray] = {}
        self._ended = False

    def serve(self, until_stdin_ends: bool, details: dict[str, Any]) -> None:
        """Serve; prints {"ready": ...} when up. Raises BusSetupError for a path that is taken."""
        with ExitStack() as stack:
            stack.callback(self._selector.close)
            listener = stack.enter_context(self._listener())
            stack.callback(self._path.unlink, missing_ok=True)
            stack.callback(self._drop_all)
            woken = self._wake_on_signals(stack)
            self._selector.register(listener, selectors.EVENT_READ, lambda: self._accept(listener))
            self._selector.register(woken, selectors.EVENT_READ, self._end)
            self._watch_stdin(until_stdin_ends)
            ready = {"camera": f"sim:{self._path}", "pid": os.getpid(), **details}
            print(json.dumps({"ready": ready}), flush=True)
            while not self._ended:
                for key, _ in self._selector.select():
                    if not self._ended:
                        key.data()

    def _listener(self) -> socket.socket:
        listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            listener.bind(str(self._path))
            listener.listen()
        except OSError as error:
            listener.close()
            reason = error.strerror or error
            raise BusSetupError(f"camera's socket {self._path}: {reason}") from None
        return listener

    def _wake_on_signals(self, stack: ExitStack) -> socket.socket:
        inner, outer = socket.socketpair()
        stack.enter_context(inner)
        stack.enter_context(outer)
        outer.setblocking(False)
        signal.set_wakeup_fd(outer.fileno())
        stack.callback(signal.set_wakeup_fd, -1)
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: None)
        return inner

    def _end(self) -> None:
        self._ended = True

    # -- clients

    def _accept(self, listener: socket.socket) -> None:
        client, _ = listener.accept()
        self._clients[client] = bytearray()
        self._selector.register(client, selectors.EVENT_READ, lambda: self._hear(client))

    def _drop(self, client: socket.socket) -> None:
        self._selector.unregister(client)
        del self._clients[client]
        client.close()

    def _drop_all(self) -> None:
        for client in list(self._clients):
            with suppress(OSError):
                client.close()

    def _hear(self, client: socket.socket) -> None:
        heard = self._clients[client]
        try:
            data = client.recv(_MOST_REQUEST)
            heard += data
            while b"\n" in heard:
                line, _, rest = heard.partition(b"\n")
                heard[:] = rest
                client.sendall(self._answer(bytes(line)))
        except OSError:  # it has gone, or the camera has
            data = b""
        if not data or len(heard) > _MOST_REQUEST:
            self._drop(client)

    def _answer(self, line: bytes) -> bytes:
        lens = self._camera.plant.lens
        size = {"width": lens.width_px, "height": lens.height_px}
        request = _requested(line)
        if request == "about":
            return json.dumps(size).encode() + b"\n"
        if request != "grab":
            return b'{"error": "unknown request; known: about, grab"}\n'
        state = self._platform.state()
        if state is None:
            return b'{"error": "no platform moves on this physics board"}\n'
        if self._camera.skip_unplugged():
            raise ConnectionResetError
        number = self._camera.taken
        pixels = self._camera.grab(state).tobytes()
        header = {**size, "time_s": state.time_s, "number": number, "bytes": len(pixels)}
        return json.dumps(header).encode() + b"\n" + pixels

    # -- faults

    def _watch_stdin(self, until_it_ends: bool) -> None:
        reader: Callable[[], None] = lambda: self._read_stdin(until_it_ends)  # noqa: E731
        with suppress(OSError, ValueError):  # a file, or none, says nothing
            self._selector.register(sys.stdin.fileno(), selectors.EVENT_READ, reader)

    def _read_stdin(self, until_it_ends: bool) -> None:
        data = os.read(sys.stdin.fileno(), _MOST_REQUEST)
        if not data:
            self._selector.unregister(sys.stdin.fileno())
            self._ended = self._ended or until_it_ends
        for line in data.decode(errors="replace").splitlines():
            print(json.dumps(self._break(line.split())), flush=True)

    def _break(self, words: list[str]) -> dict[str, Any]:
        camera = self._camera
        match words:
            case ["dark"]:
                camera.dark = True
            case ["defocus", pixels] if pixels.replace(".", "", 1).isdigit():
                camera.defocus_px = min(float(pixels), 100.0)
            case ["mend"]:
                camera.dark, camera.defocus_px = False, 0.0
            case ["unplug"]:
                self._ended = True
            case _:
                return {"error": f"{' '.join(words)!r}; allowed: {_FAULTS}"}
        return {"done": " ".join(words)}


def _requested(line: bytes) -> str:
    try:
        asked = json.loads(line)
    except ValueError:
        return ""
    return str(asked.get("do", "")) if isinstance(asked, dict) else ""

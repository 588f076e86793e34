"""Serves a simulated camera on a Unix socket, in a separate process beside the bus.

A client sends lines of JSON and receives one line of JSON for each:

    {"do": "about"}   {"width": 1280, "height": 1024}
    {"do": "grab"}    {"width": 1280, "height": 1024, "time_s": 12.5, "number": 3, "bytes": 1310720}
                      followed by that number of bytes: grey levels, row by row
    anything else     {"error": "..."}

Clients are disconnected while the plant file unplugs the camera. `time_s` is bus time in the
middle of the exposure.
"""

from __future__ import annotations

import json
import os
import signal
import socketserver
import sys
import threading
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

from cdpr_sim_bus.camera.sim_camera import SimCamera
from cdpr_sim_bus.errors import BusSetupError
from cdpr_sim_bus.physics_board import BoardPlatform

_MOST_REQUEST = 4096
_FAULTS = "dark, defocus PIXELS, mend, unplug"


class _EndedError(Exception):
    """The camera is unplugged, or its process was asked to end."""


class CameraServer:
    """Answers clients until SIGTERM, SIGINT or `unplug`; one request at a time.

    Lines on standard input create and mend faults: `dark`, `defocus 6`, `mend`, `unplug`. The
    server answers each with a line of JSON on standard output.
    """

    def __init__(self, camera: SimCamera, platform: BoardPlatform, path: Path) -> None:
        self._camera, self._platform, self._path = camera, platform, path
        self._busy = threading.Lock()

    def serve(self, until_stdin_ends: bool, details: dict[str, Any]) -> None:
        """Serve; print {"ready": ...} when ready. Raises BusSetupError if the path is taken."""
        try:
            listener = socketserver.ThreadingUnixStreamServer(str(self._path), self._handler())
        except OSError as error:
            reason = error.strerror or error
            raise BusSetupError(f"camera's socket {self._path}: {reason}") from None
        listener.daemon_threads, listener.block_on_close = True, False
        try:
            for number in (signal.SIGINT, signal.SIGTERM):
                signal.signal(number, _end)
            threading.Thread(target=listener.serve_forever, daemon=True).start()
            ready = {"camera": f"sim:{self._path}", "pid": os.getpid(), **details}
            print(json.dumps({"ready": ready}), flush=True)
            self._obey()
            while not until_stdin_ends:
                signal.pause()
        except _EndedError:
            pass
        finally:
            self._busy.acquire()  # nothing reads the platform any more
            self._path.unlink(missing_ok=True)
            listener.server_close()

    # -- clients

    def _handler(self) -> type[socketserver.StreamRequestHandler]:
        answers = self._answers

        class Handler(socketserver.StreamRequestHandler):
            def handle(self) -> None:
                with suppress(OSError):  # the client or the camera is gone
                    for answer in answers(iter(lambda: self.rfile.readline(_MOST_REQUEST), b"")):
                        self.wfile.write(answer)

        return Handler

    def _answers(self, lines: Iterator[bytes]) -> Iterator[bytes]:
        """Yield the answer to each line; disconnect a client that sends no lines."""
        for line in lines:
            if not line.endswith(b"\n"):
                return
            with self._busy:
                answer = self._answer(line)
            yield answer

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

    def _obey(self) -> None:
        """Execute the lines of standard input until it ends."""
        with suppress(OSError, ValueError):  # a closed input has no lines
            for line in sys.stdin or ():
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
                print(json.dumps({"done": "unplug"}), flush=True)
                raise _EndedError
            case _:
                return {"error": f"{' '.join(words)!r}; allowed: {_FAULTS}"}
        return {"done": " ".join(words)}


def _requested(line: bytes) -> str:
    try:
        asked = json.loads(line)
    except ValueError:
        return ""
    return str(asked.get("do", "")) if isinstance(asked, dict) else ""


def _end(*_: object) -> None:
    raise _EndedError

"""The simulated bus by the socketcand protocol, on loopback (github.com/linux-can/socketcand).

A program of its own, `python -m cdpr_sim_bus.bus.adapters.socketcand_server NAME PORT`,
which ends with its standard input or with the bus. Killing it is losing the connection.
"""

from __future__ import annotations

import os
import re
import selectors
import socket
import sys
import time
from contextlib import suppress

from cdpr_sim_bus.bus.adapters.gateway import join, raise_priority, receive_all, report
from cdpr_sim_bus.errors import BusSetupError
from cdpr_sim_bus.frame import (
    EFF_FLAG,
    EFF_MASK,
    FRAME,
    FRAME_BYTES,
    RTR_FLAG,
    SFF_MASK,
    pack_frame,
)

ALIAS = "can0"
"""A second name of the bus, for clients that only know interface names."""

_HOST = "127.0.0.1"
_READ_BYTES = 4096
_LONGEST_COMMAND = 256
_MOST_BYTES_WAITING = 1 << 20
_PAUSE_S = 0.02
"""No frames so long after raw mode: python-can takes the answer for one message by itself."""
_SEND = re.compile(r"([0-9A-Fa-f]{3}|[0-9A-Fa-f]{8}) ([0-8])((?: +[0-9A-Fa-f]{1,2})*)")


class Connection:
    """One client; it joins the bus when it opens it."""

    def __init__(self, name: str, sock: socket.socket, selector: selectors.BaseSelector) -> None:
        sock.setblocking(False)
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.pause_until_s = 0.0
        """When the waiting frames may be sent; 0 while none is held back."""
        self.dropped = 0
        """Frames that the client had no room for."""
        self._name = name
        self._sock = sock
        self._selector = selector
        self._bus: socket.socket | None = None
        self._raw = False
        self._text = ""
        self._waiting = bytearray()
        selector.register(sock, selectors.EVENT_READ, self._serve)
        try:
            self._send_text("< hi >")
        except OSError:  # it has left already
            self.close()

    def _serve(self, events: int) -> None:
        try:
            if events & selectors.EVENT_WRITE:
                self._flush()
            if events & selectors.EVENT_READ:
                data = self._sock.recv(_READ_BYTES)
                if not data:
                    raise ConnectionResetError
                # a client that leaves TCP's delays on would wait for our acknowledgement
                self._sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_QUICKACK, 1)
                self._take(data.decode("ascii", "replace"))
        except BlockingIOError:
            return
        except OSError:
            self.close()

    def _take(self, text: str) -> None:
        """Carry out the commands in `text`, each between `<` and `>`."""
        self._text += text
        while (end := self._text.find(">")) >= 0:
            command, self._text = self._text[:end], self._text[end + 1 :]
            start = command.rfind("<")
            # one space belongs to each bracket; a frame without data has two before the second
            self._obey(command[start + 1 :].strip() if start >= 0 else "")
        if len(self._text) > _LONGEST_COMMAND:
            self._text = ""
            self._send_text("< error command too long >")

    def _obey(self, command: str) -> None:
        word, _, rest = command.partition(" ")
        if word == "echo":
            self._send_text("< echo >")
        elif word == "open":
            self._open(rest.strip())
        elif self._bus is None:
            self._send_text("< error no bus is open >")
        elif word == "rawmode":
            self._send_text("< ok >")
            self._raw = True
            receive_all(self._bus, listen=True)
            self._hold_back()
        elif word == "send":
            self._send(rest)
        else:
            self._send_text("< error unknown command >")

    def _open(self, name: str) -> None:
        if self._bus is not None:
            self._send_text("< error a bus is open already >")
            return
        if name not in (self._name, ALIAS):
            self._send_text("< error could not open bus >")
            return
        try:
            self._bus = join(self._name)
        except BusSetupError:
            self._send_text("< error could not open bus >")
            return
        self._selector.register(self._bus, selectors.EVENT_READ, self._take_frames)
        self._send_text("< ok >")

    def _send(self, text: str) -> None:
        assert self._bus is not None
        match = _SEND.fullmatch(text)
        data = bytes(int(octet, 16) for octet in match[3].split()) if match else b""
        if match is None or len(data) != int(match[2]):
            self._send_text("< error malformed send command >")
            return
        can_id = int(match[1], 16)
        if can_id > (SFF_MASK if len(match[1]) == 3 else EFF_MASK):
            self._send_text("< error malformed send command >")
            return
        can_id |= 0 if len(match[1]) == 3 else EFF_FLAG
        try:
            self._bus.send(pack_frame(can_id, data))
        except BlockingIOError:
            self._send_text("< error transmit buffer full >")

    # -- frames of the bus

    def _hold_back(self) -> None:
        assert self._bus is not None
        self.pause_until_s = time.monotonic() + _PAUSE_S
        self._selector.unregister(self._bus)

    def end_pause(self) -> None:
        """Send the frames of the bus from now on."""
        assert self._bus is not None
        self.pause_until_s = 0.0
        self._selector.register(self._bus, selectors.EVENT_READ, self._take_frames)

    def _take_frames(self, _events: int) -> None:
        assert self._bus is not None
        now = time.time()
        try:
            with suppress(BlockingIOError):
                while packet := self._bus.recv(FRAME_BYTES):
                    if not self._raw or len(self._waiting) > _MOST_BYTES_WAITING:
                        self.dropped += 1
                    else:
                        self._waiting += _text_of(packet, now)
                raise ConnectionResetError
            with suppress(BlockingIOError):
                self._flush()
        except OSError:
            self.close()

    def _send_text(self, text: str) -> None:
        self._waiting += text.encode("ascii")
        with suppress(BlockingIOError):
            self._flush()

    def _flush(self) -> None:
        """Send what waits, and ask to be called again for what there was no room for."""
        try:
            while self._waiting:
                del self._waiting[: self._sock.send(self._waiting)]
        except BlockingIOError:
            self._watch(selectors.EVENT_READ | selectors.EVENT_WRITE)
            raise
        self._watch(selectors.EVENT_READ)

    def _watch(self, events: int) -> None:
        if self._selector.get_key(self._sock).events != events:
            self._selector.modify(self._sock, events, self._serve)

    @property
    def closed(self) -> bool:
        """Whether client or bus have disconnected."""
        return self._sock.fileno() < 0

    def close(self) -> None:
        """Disconnect the client from the bus."""
        for sock in (self._sock, self._bus):
            if sock is not None and sock.fileno() >= 0:
                with suppress(KeyError):
                    self._selector.unregister(sock)
                sock.close()


def _text_of(frame: bytes, wall_s: float) -> bytes:
    """Return a frame as a message; the protocol has none for remote frames."""
    can_id, length, data = FRAME.unpack(frame)
    if can_id & RTR_FLAG:
        return b""
    head = f"{can_id & EFF_MASK:08X}" if can_id & EFF_FLAG else f"{can_id & SFF_MASK:03X}"
    return f"< frame {head} {wall_s:.6f} {data[:length].hex().upper()} >".encode("ascii")


def _read_stdin(_events: int) -> bytes:
    return os.read(sys.stdin.fileno(), _READ_BYTES)


def serve(name: str, listener: socket.socket) -> None:
    """Serve the bus `name` to all who connect, until standard input ends or the bus goes away."""
    bus = join(name)  # a client without filters: its socket closes when the bus ends
    connections: list[Connection] = []
    with selectors.DefaultSelector() as selector:
        selector.register(sys.stdin, selectors.EVENT_READ, _read_stdin)
        # frames of the moment before the hub knew that none are wanted are no end
        selector.register(bus, selectors.EVENT_READ, lambda _: bus.recv(FRAME_BYTES))
        selector.register(listener, selectors.EVENT_READ, None)
        while True:
            held = [c for c in connections if c.pause_until_s and not c.closed]
            now = time.monotonic()
            wait_s = max(min(c.pause_until_s for c in held) - now, 0.0) if held else None
            for key, events in selector.select(wait_s):
                if key.fileobj is listener:
                    with suppress(OSError):  # a client that has left already
                        connections.append(Connection(name, listener.accept()[0], selector))
                elif key.fileobj in (sys.stdin, bus):
                    if not key.data(events):
                        return
                elif key.fileobj.fileno() >= 0:  # type: ignore[union-attr]  # sockets only
                    key.data(events)
            connections = [c for c in connections if not c.closed]
            for connection in connections:
                if connection.pause_until_s and connection.pause_until_s <= time.monotonic():
                    connection.end_pause()


def main() -> None:
    """Serve the bus and port given as arguments (port 0: any); report the port."""
    name, port = sys.argv[1], int(sys.argv[2])
    try:
        listener = socket.create_server((_HOST, port))
    except OSError as error:
        report({"error": f"socketcand server on {_HOST}:{port}: {error.strerror}"})
        return
    listener.setblocking(False)
    with listener:
        report({"port": listener.getsockname()[1]})
        raise_priority()
        with suppress(BusSetupError):  # the bus has ended meanwhile
            serve(name, listener)


if __name__ == "__main__":
    main()

"""Gateways to the simulated bus, each a process and a client of the hub.

`python -m cdpr_sim_bus.bus.gateways slcan NAME BITRATE` is a serial CAN adapter on a
pseudo-terminal, `... socketcand NAME PORT` a socketcand server on loopback
(github.com/linux-can/socketcand). They end with their standard input or with the bus. To unplug
the adapter, or to cut the connection, kill the process.
"""

from __future__ import annotations

import json
import os
import pty
import re
import select
import selectors
import socket
import subprocess
import sys
import time
import tty
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from cdpr_sim_bus.bus.client import bus_address
from cdpr_sim_bus.bus.hub import encode
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

_STOP_TIMEOUT_S = 5.0
_PRIORITY = 40
_MODULE = "cdpr_sim_bus.bus.gateways"


def join(name: str) -> socket.socket:
    """Return a socket connected to the bus `name`, which receives no frames yet.

    Raises:
        BusSetupError: no such bus runs.
    """
    sock = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    try:
        sock.connect(bus_address(name))
        sock.send(encode({"filters": []}))
    except OSError as error:
        sock.close()
        raise BusSetupError(
            f"simbus:{name}: no simulated bus of that name is running ({error.strerror}); "
            "`cdpr sim up` starts one"
        ) from None
    sock.setblocking(False)
    return sock


def receive_all(sock: socket.socket, *, listen: bool) -> None:
    """Set the filters to pass all frames, or none."""
    sock.send(encode({"filters": [[0, 0]] if listen else []}))


def raise_priority() -> None:
    """Run at real-time priority, as an adapter's processor would, if that is allowed."""
    with suppress(PermissionError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))


def report(message: dict[str, Any]) -> None:
    """Print one line of JSON for the simulator that started this gateway."""
    print(json.dumps(message), flush=True)


class Gateway:
    """A gateway process that ends with the simulator; to unplug the gateway, kill the process."""

    def __init__(self, *arguments: str) -> None:
        """Start the process with these arguments and wait until it is ready.

        Raises:
            BusSetupError: it did not start; the message has its reason.
        """
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", _MODULE, *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            start_new_session=True,  # the simulator handles a Ctrl-C at the terminal
        )
        assert self._process.stdout is not None  # opened with PIPE
        line = self._process.stdout.readline()
        self.report: dict[str, Any] = (
            json.loads(line) if line else {"error": f"{arguments[0]} ended"}
        )
        """The message that the process printed when it started."""
        if "error" in self.report:
            self.close()
            raise BusSetupError(self.report["error"])

    @property
    def pid(self) -> int:
        """Process id of the gateway."""
        return self._process.pid

    def close(self) -> None:
        """End the process."""
        assert self._process.stdin is not None  # opened with PIPE
        assert self._process.stdout is not None
        self._process.stdin.close()
        try:
            self._process.wait(_STOP_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._process.stdout.close()


# The ASCII protocol of serial CAN adapters, from the adapter's side (Lawicel CAN232/CANUSB).

BITRATES = (10_000, 20_000, 50_000, 100_000, 125_000, 250_000, 500_000, 800_000, 1_000_000)
"""Bit rates of S0 to S8, bit/s."""

_OK, _BELL = b"\r", b"\a"
_VERSION, _SERIAL_NUMBER = b"V1013\r", b"NSIM1\r"
_CLOCK_HZ = 8_000_000  # of the SJA1000's time quanta, before the prescaler
_MINUTE_MS = 60_000
_LONGEST_LINE = 30
# flags of the answer to F
RX_FULL, TX_FULL, WARNING, OVERRUN = 0x01, 0x02, 0x04, 0x08
PASSIVE, BUS_ERROR = 0x20, 0x80


class LawicelAdapter:
    """Executes commands and returns answers; frames are 16 bytes, laid out as `struct can_frame`.

    An adapter whose bit rate differs from that of the bus transfers no frames: no node
    acknowledges its frames, and it becomes error-passive.
    """

    def __init__(self, bus_bitrate: int, transmit: Callable[[bytes], bool]) -> None:
        """`transmit` puts a frame on the bus and returns whether there was room for it."""
        self.open = False
        self.flags = 0
        """Latched status flags, as F reports them; reading clears them."""
        self._bus_bitrate = bus_bitrate
        self._transmit = transmit
        self._bitrate = 0
        self._listen_only = False
        self._time_stamps = False
        self._line = bytearray()
        self._commands: dict[int, Callable[[bytes], bytes]] = {
            ord("S"): self._set_bitrate,
            ord("s"): self._set_timing,
            ord("O"): self._open,
            ord("L"): self._open,
            ord("C"): self._close,
            ord("Z"): self._set_time_stamps,
            ord("F"): self._read_flags,
            ord("V"): lambda line: _VERSION if line == b"V" else _BELL,
            ord("N"): lambda line: _SERIAL_NUMBER if line == b"N" else _BELL,
            **dict.fromkeys(b"tTrR", self._send),
        }

    @property
    def on_bus(self) -> bool:
        """Whether frames of the bus reach the adapter."""
        return self.open and self._bitrate == self._bus_bitrate

    def lines(self, data: bytes) -> list[bytes]:
        """Process characters from the serial line; return the commands that are complete now.

        A line longer than any command is truncated, so that it is rejected.
        """
        parts = data.split(b"\r")
        whole = []
        for part in parts[:-1]:
            whole.append(bytes(self._line + part)[:_LONGEST_LINE])
            self._line.clear()
        self._line += parts[-1]
        del self._line[_LONGEST_LINE:]
        return whole

    def obey(self, line: bytes) -> bytes:
        """Execute one command (without its CR) and return the answer."""
        if not line:
            return _OK
        command = self._commands.get(line[0])
        try:
            return command(line) if command is not None else _BELL
        except ValueError:
            return _BELL

    def text_of(self, frame: bytes, wall_s: float) -> bytes:
        """Return the line for a frame received at `wall_s`."""
        can_id, length, data = FRAME.unpack(frame)
        remote = bool(can_id & RTR_FLAG)
        if can_id & EFF_FLAG:
            head = f"{'R' if remote else 'T'}{can_id & EFF_MASK:08X}{length}"
        else:
            head = f"{'r' if remote else 't'}{can_id & SFF_MASK:03X}{length}"
        body = "" if remote else data[:length].hex().upper()
        stamp = f"{int(wall_s * 1000) % _MINUTE_MS:04X}" if self._time_stamps else ""
        return f"{head}{body}{stamp}\r".encode()

    # -- commands

    def _set_bitrate(self, line: bytes) -> bytes:
        code = line[1:]
        if self.open or len(code) != 1 or code not in b"012345678":
            return _BELL
        self._bitrate = BITRATES[int(code)]
        return _OK

    def _set_timing(self, line: bytes) -> bytes:
        """Set the SJA1000's bus timing registers 0 and 1."""
        if self.open or len(line) != 5:
            return _BELL
        btr0, btr1 = bytes.fromhex(line[1:].decode("ascii"))
        quanta = 3 + (btr1 & 0x0F) + (btr1 >> 4 & 0x07)
        self._bitrate = _CLOCK_HZ // ((btr0 & 0x3F) + 1) // quanta
        return _OK

    def _open(self, line: bytes) -> bytes:
        if self.open or not self._bitrate or len(line) != 1:
            return _BELL
        self.open = True
        self.flags = 0
        self._listen_only = line == b"L"
        return _OK

    def _close(self, line: bytes) -> bytes:
        if not self.open or len(line) != 1:
            return _BELL
        self.open = False
        return _OK

    def _set_time_stamps(self, line: bytes) -> bytes:
        if self.open or line not in (b"Z0", b"Z1"):
            return _BELL
        self._time_stamps = line == b"Z1"
        return _OK

    def _read_flags(self, line: bytes) -> bytes:
        if not self.open or len(line) != 1:
            return _BELL
        flags, self.flags = self.flags, 0
        if not self.on_bus:
            self.flags = flags & (WARNING | PASSIVE)  # states, which reading does not clear
        return f"F{flags:02X}\r".encode()

    def _send(self, line: bytes) -> bytes:
        if not self.open or self._listen_only:
            return _BELL
        frame = _parse(line)
        if not self.on_bus:
            self.flags |= WARNING | PASSIVE | BUS_ERROR | TX_FULL
            return _BELL
        if not self._transmit(frame):
            self.flags |= TX_FULL
            return _BELL
        return b"Z\r" if line[:1] in b"TR" else b"z\r"


def _parse(line: bytes) -> bytes:
    """Return the frame of a t, T, r or R line; raises ValueError."""
    kind = chr(line[0])
    digits = 8 if kind in "TR" else 3
    text = line[1:].decode("ascii")
    can_id, length = _hex(text[:digits]), int(text[digits : digits + 1])
    if can_id > (EFF_MASK if digits == 8 else SFF_MASK) or length > 8:
        raise ValueError(line)
    can_id |= EFF_FLAG if digits == 8 else 0
    body = text[digits + 1 :]
    if kind in "rR":
        can_id |= RTR_FLAG
        length_of_body = 0
    else:
        length_of_body = 2 * length
    if len(body) != length_of_body:
        raise ValueError(line)
    return FRAME.pack(can_id, length, _octets(body))


def _hex(text: str) -> int:
    if not all(character in "0123456789ABCDEFabcdef" for character in text):
        raise ValueError(text)
    return int(text, 16)


def _octets(text: str) -> bytes:
    return bytes(_hex(text[i : i + 2]) for i in range(0, len(text), 2))


LINE_BAUD = 1_000_000
"""Speed of the serial line, about that of USB adapters; the terminal's setting has no effect."""
_CHARACTER_S = 10 / LINE_BAUD
_QUEUED_FRAMES = 256
_READ_BYTES = 512
_AHEAD_S = 0.002
"""Longest time by which the host may be ahead of the line. Beyond it, writes wait as on a real
port.
"""


class SerialAdapter:
    """The adapter between a pseudo-terminal and the bus; each character takes its real time."""

    def __init__(self, name: str, bus_bitrate: int) -> None:
        self._bus = join(name)
        self._host, self._terminal = pty.openpty()
        # kept open, so that the adapter outlives the programs that use it
        tty.setraw(self._terminal)
        os.set_blocking(self._host, False)
        self.path = os.ttyname(self._terminal)
        self._adapter = LawicelAdapter(bus_bitrate, self._transmit)
        self._listening = False
        self._commands: deque[tuple[float, bytes]] = deque()
        self._answers: deque[tuple[float, bytes]] = deque()
        self._in_free_s = self._out_free_s = 0.0

    def run(self) -> None:
        """Serve until standard input ends or the bus is gone."""
        while True:
            now = time.monotonic()
            watched = [sys.stdin.fileno(), self._bus.fileno()]
            if self._in_free_s - now < _AHEAD_S:
                watched.append(self._host)
            ready, _, _ = select.select(watched, [], [], self._wait_s(now))
            if sys.stdin.fileno() in ready and not os.read(sys.stdin.fileno(), _READ_BYTES):
                return
            if self._bus.fileno() in ready and not self._take_frames():
                return
            now = time.monotonic()
            if self._host in ready:
                self._take_characters(now)
            while self._commands and self._commands[0][0] <= now:
                self._obey(self._commands.popleft()[1], now)
            while self._answers and self._answers[0][0] <= now:
                self._write(self._answers.popleft()[1])

    def _wait_s(self, now: float) -> float | None:
        due = [queue[0][0] for queue in (self._commands, self._answers) if queue]
        if self._in_free_s - now >= _AHEAD_S:
            due.append(self._in_free_s - _AHEAD_S / 2)
        return max(min(due) - now, 0.0) if due else None

    def _take_characters(self, now: float) -> None:
        data = os.read(self._host, _READ_BYTES)
        self._in_free_s = max(self._in_free_s, now)
        for line in self._adapter.lines(data):
            self._in_free_s += (len(line) + 1) * _CHARACTER_S
            self._commands.append((self._in_free_s, line))

    def _obey(self, line: bytes, now: float) -> None:
        self._send_text(self._adapter.obey(line), now)
        if self._adapter.on_bus != self._listening:
            self._listening = self._adapter.on_bus
            receive_all(self._bus, listen=self._listening)

    def _transmit(self, frame: bytes) -> bool:
        try:
            self._bus.send(frame)
        except BlockingIOError:
            return False
        return True

    def _take_frames(self) -> bool:
        """Forward frames from the bus; return whether the bus still exists."""
        try:
            while packet := self._bus.recv(FRAME_BYTES):
                if not self._adapter.on_bus:
                    continue
                if len(self._answers) < _QUEUED_FRAMES:
                    self._send_text(self._adapter.text_of(packet, time.time()), time.monotonic())
                else:
                    self._adapter.flags |= RX_FULL | OVERRUN
        except BlockingIOError:
            return True
        except OSError:
            return False
        return False

    def _send_text(self, text: bytes, now: float) -> None:
        self._out_free_s = max(self._out_free_s, now) + len(text) * _CHARACTER_S
        self._answers.append((self._out_free_s, text))

    def _write(self, text: bytes) -> None:
        try:
            os.write(self._host, text)
        except BlockingIOError:
            # the host does not read: frames without room are lost
            self._adapter.flags |= OVERRUN


# The socketcand protocol.

ALIAS = "can0"
"""A second name of the bus, for clients that accept only interface names."""

_HOST = "127.0.0.1"
_TCP_READ_BYTES = 4096
_LONGEST_COMMAND = 256
_MOST_BYTES_WAITING = 1 << 20
_PAUSE_S = 0.02
"""Pause before frames after raw mode: python-can expects the answer as a separate message."""
_SEND = re.compile(r"([0-9A-Fa-f]{3}|[0-9A-Fa-f]{8}) ([0-8])((?: +[0-9A-Fa-f]{1,2})*)")


class Connection:
    """One client; it joins the bus when the client opens it."""

    def __init__(self, name: str, sock: socket.socket, selector: selectors.BaseSelector) -> None:
        sock.setblocking(False)
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.pause_until_s = 0.0
        """Time at which the waiting frames may be sent; 0 if none are held back."""
        self.dropped = 0
        """Frames lost because the client had no room for them."""
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
        except OSError:  # the client has left already
            self.close()

    def _serve(self, events: int) -> None:
        try:
            if events & selectors.EVENT_WRITE:
                self._flush()
            if events & selectors.EVENT_READ:
                data = self._sock.recv(_TCP_READ_BYTES)
                if not data:
                    raise ConnectionResetError
                # acknowledge immediately: a client with TCP's default delays would wait for it
                self._sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_QUICKACK, 1)
                self._take(data.decode("ascii", "replace"))
        except BlockingIOError:
            return
        except OSError:
            self.close()

    def _take(self, text: str) -> None:
        """Execute the commands in `text`, each between `<` and `>`."""
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
        """Send waiting data; request another call for the rest that had no room."""
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
        """Whether the client or the bus has disconnected."""
        return self._sock.fileno() < 0

    def close(self) -> None:
        """Disconnect the client from the bus."""
        for sock in (self._sock, self._bus):
            if sock is not None and sock.fileno() >= 0:
                with suppress(KeyError):
                    self._selector.unregister(sock)
                sock.close()


def _text_of(frame: bytes, wall_s: float) -> bytes:
    """Return a frame as a message; the protocol has no message for remote frames."""
    can_id, length, data = FRAME.unpack(frame)
    if can_id & RTR_FLAG:
        return b""
    head = f"{can_id & EFF_MASK:08X}" if can_id & EFF_FLAG else f"{can_id & SFF_MASK:03X}"
    return f"< frame {head} {wall_s:.6f} {data[:length].hex().upper()} >".encode("ascii")


def _read_stdin(_events: int) -> bytes:
    return os.read(sys.stdin.fileno(), _TCP_READ_BYTES)


def serve_socketcand(name: str, listener: socket.socket) -> None:
    """Serve the bus `name` to all clients until standard input ends or the bus is gone."""
    bus = join(name)  # joined without filters, only to notice the end of the bus
    connections: list[Connection] = []
    with selectors.DefaultSelector() as selector:
        selector.register(sys.stdin, selectors.EVENT_READ, _read_stdin)
        # before the hub has set the filters, frames may arrive; only an error means the end
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
    """Report the terminal's path or the port, then serve the bus as the arguments say."""
    kind, name, number = sys.argv[1], sys.argv[2], int(sys.argv[3])
    if kind == "slcan":
        try:
            adapter = SerialAdapter(name, number)
        except (BusSetupError, OSError) as error:
            report({"error": f"serial adapter: {error}"})
            return
        report({"path": adapter.path})
        raise_priority()
        adapter.run()
        return
    try:
        listener = socket.create_server((_HOST, number))
    except OSError as error:
        report({"error": f"socketcand server on {_HOST}:{number}: {error.strerror}"})
        return
    listener.setblocking(False)
    with listener:
        report({"port": listener.getsockname()[1]})
        raise_priority()
        with suppress(BusSetupError):  # the bus has ended in the meantime
            serve_socketcand(name, listener)


if __name__ == "__main__":
    main()

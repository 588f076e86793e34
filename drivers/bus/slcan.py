"""Serial CAN adapters that speak the Lawicel ASCII protocol (slcan), through pyserial."""

from __future__ import annotations

import errno
import os
import re
import select
import threading
import time
from typing import Any

import serial  # type: ignore[import-untyped]  # it has no type hints

from cdpr_drivers.bus.frames import (
    EFF_FLAG,
    EFF_MASK,
    ERR_FLAG,
    FRAME,
    RTR_FLAG,
    SEND_TIMEOUT_S,
    SFF_MASK,
    Bytes,
)
from cdpr_drivers.bus.url import BusUrl
from cdpr_drivers.errors import BusError

BITRATE_CODES = {
    10_000: "S0", 20_000: "S1", 50_000: "S2", 100_000: "S3", 125_000: "S4",
    250_000: "S5", 500_000: "S6", 800_000: "S7", 1_000_000: "S8",
}  # fmt: skip
"""Bit rates of the protocol, bit/s, and their commands."""

_OPTIONS = ("bitrate", "tty_baudrate", "lockstep")
_DEFAULT_BAUD = 115_200  # python-can's default; most USB adapters ignore it
_READ_BYTES = 4096
_SYNCHRONISE_S, _ANSWER_S = 0.6, 0.3
_FRAME_LETTERS = (b"t", b"T", b"r", b"R")
_SENT_LETTERS = (b"z", b"Z")
_FLAGS_EVERY_S = 0.5
_ENDS = re.compile(rb"([^\r\a]*)([\r\a])")
_VERSION = rb"V|.*[a-z]"
"""Beginning of an answer to V. The firmware of CANable adapters answers with a commit and an
address; the rest of a frame has no lower-case letters.
"""
_LONGEST_LINE = 64
# flags of F (SJA1000), and the Linux error frames that they become
_RX_FULL, _TX_FULL, _WARNING, _OVERRUN, _PASSIVE, _BUS_ERROR = 0x01, 0x02, 0x04, 0x08, 0x20, 0x80
_ERR_CONTROLLER, _ERR_BUS_ERROR = 0x004, 0x080
_DETAIL_RX_OVERFLOW, _DETAIL_TX_OVERFLOW = 0x01, 0x02
_DETAIL_WARNING, _DETAIL_PASSIVE, _DETAIL_ACTIVE = 0x08, 0x20, 0x40
_REFUSED = FRAME.pack(ERR_FLAG | _ERR_CONTROLLER, 8, bytes([0, _DETAIL_TX_OVERFLOW]))


class SlcanAdapter:
    """An adapter on a serial port, with its CAN channel open.

    Errors that the adapter reports are received as error frames, as with SocketCAN.
    """

    def __init__(self, url: BusUrl) -> None:
        """Open port and adapter; raises BusError."""
        code = _bitrate_code(url)
        baud = url.options.get("tty_baudrate", _DEFAULT_BAUD)
        self._serial = _open_port(url, baud)
        self._fd: int = self._serial.fileno()
        self._sending = threading.Lock()
        self._rest = b""
        self._partly_sent = False
        """Whether only part of the last line was sent."""
        self._reported_flags = 0
        self._query_at_s = 0.0
        try:
            self._begin(url, code, baud)
        except OSError as error:
            self._serial.close()
            raise BusError(f"{url}: the adapter is lost ({error.strerror})") from None
        except BusError:
            self._serial.close()
            raise

    def _begin(self, url: BusUrl, code: str | None, baud: object) -> None:
        """Bring the adapter from any previous state to an open channel."""
        self._serial.reset_input_buffer()
        # answers before the version belong to earlier commands
        self._put(b"\rC\r")
        version = self._command("V", _SYNCHRONISE_S, _VERSION)
        self._rest = b""
        answers = []
        for command in ([code] if code else []) + ["O"]:
            answers.append(self._command(command))
            if answers[-1] == b"\a":
                rate = f"bit rate {url.options.get('bitrate')} ({code})"
                what = rate if command != "O" else "the command to open"
                advice = "" if code else "; it may need ?bitrate=1000000"
                raise BusError(f"{url}: the adapter rejects {what}{advice}")
        if version is None and not any(answers):
            raise BusError(
                f"{url}: no serial CAN adapter (slcan) answers at {baud} baud; "
                "check the port and ?tty_baudrate="
            )
        if (self._command("F") or b"").startswith(b"F"):
            self._query_at_s = time.monotonic() + _FLAGS_EVERY_S

    def _command(self, text: str, timeout_s: float = _ANSWER_S, like: bytes = b"") -> bytes | None:
        """Return the answer to a command, with its CR or BEL; None if no answer arrived in time.

        Skip frames and answers that do not begin `like` this.
        """
        self._put(text.encode() + b"\r")
        deadline = time.monotonic() + timeout_s
        while (left := deadline - time.monotonic()) > 0.0:
            self._rest += self._fetch(left)
            while match := _ENDS.match(self._rest):
                self._rest = self._rest[match.end() :]
                line = match[1]
                if line[:1] not in _FRAME_LETTERS + _SENT_LETTERS and re.match(like, line):
                    return match[0] if line else match[2]
        return None

    def _fetch(self, timeout_s: float) -> bytes:
        """Return the bytes that arrive in time, or b""; raises OSError if the port is lost."""
        return self._read() if select.select([self._fd], [], [], timeout_s)[0] else b""

    def _read(self) -> bytes:
        try:
            data, reason = os.read(self._fd, _READ_BYTES), ""
        except BlockingIOError:
            return b""
        except OSError as error:
            data, reason = b"", f": {error.strerror}"
        if not data:
            raise OSError(errno.ENODEV, f"the serial adapter was unplugged{reason}")
        return data

    def read(self, wake: int, /) -> list[bytes]:
        """Return the frames that arrived; raises OSError if the adapter is gone."""
        wait_s = _FLAGS_EVERY_S if self._query_at_s else None
        ready, _, _ = select.select([self._fd, wake], [], [], wait_s)
        if self._query_at_s and time.monotonic() > self._query_at_s:
            self._put(b"F\r")
            self._query_at_s = time.monotonic() + _FLAGS_EVERY_S
        if self._fd not in ready:
            return []
        text = self._rest + self._read()
        frames, end = [], 0
        for match in _ENDS.finditer(text):
            end = match.end()
            frame = self._frame_of(match[1], match[2])
            if frame is not None:
                frames.append(frame)
        self._rest = text[end:][-_LONGEST_LINE:]
        return frames

    def _frame_of(self, line: bytes, ending: bytes) -> bytes | None:
        """Return the frame in a line; None for other answers and for malformed lines."""
        if ending == b"\a":
            return _REFUSED
        kind = line[:1]
        try:
            if kind == b"F":
                return self._error_frame(int(line[1:3], 16))
            if kind not in _FRAME_LETTERS:
                return None
            at = 9 if kind.isupper() else 4
            can_id, length = int(line[1:at], 16), int(line[at : at + 1])
            is_remote = kind in b"rR"
            octets = b"" if is_remote else line[at + 1 : at + 1 + 2 * length]
            data = bytes.fromhex(octets.decode())
        except ValueError:
            return None
        if length > 8 or len(data) != (0 if is_remote else length):
            return None
        can_id = can_id & EFF_MASK | EFF_FLAG if kind.isupper() else can_id & SFF_MASK
        return FRAME.pack(can_id | RTR_FLAG * is_remote, length, data)

    def _error_frame(self, flags: int) -> bytes | None:
        """Return the adapter's status flags as an error frame; None if they have not changed."""
        if not flags and not self._reported_flags:
            return None
        self._reported_flags = flags
        detail = _DETAIL_RX_OVERFLOW if flags & (_RX_FULL | _OVERRUN) else 0
        detail |= _DETAIL_TX_OVERFLOW if flags & _TX_FULL else 0
        if flags & _PASSIVE:
            detail |= _DETAIL_PASSIVE
        elif flags & _WARNING:
            detail |= _DETAIL_WARNING
        else:
            detail |= _DETAIL_ACTIVE
        kind = ERR_FLAG | _ERR_CONTROLLER | (_ERR_BUS_ERROR if flags & _BUS_ERROR else 0)
        return FRAME.pack(kind, 8, bytes([0, detail]))

    def write(self, frame: Bytes, /) -> None:
        """Send a frame; raises OSError, or BlockingIOError if the adapter accepts nothing."""
        can_id, length, data = FRAME.unpack(frame)
        kind, body = ("r", "") if can_id & RTR_FLAG else ("t", data[:length].hex().upper())
        if can_id & EFF_FLAG:
            head = f"{kind.upper()}{can_id & EFF_MASK:08X}"
        else:
            head = f"{kind}{can_id & SFF_MASK:03X}"
        self._put(f"{head}{length}{body}\r".encode())

    def _put(self, text: bytes) -> None:
        with self._sending:
            deadline = 0.0
            if self._partly_sent:
                text = b"\r" + text  # ends the partly sent line, which the adapter rejects
            while True:
                try:
                    text = text[os.write(self._fd, text) :]
                    self._partly_sent = bool(text)
                except BlockingIOError:
                    now = time.monotonic()
                    deadline = deadline or now + SEND_TIMEOUT_S
                    if now > deadline:
                        raise
                if not text:
                    return
                select.select([], [self._fd], [], SEND_TIMEOUT_S)

    def close(self) -> None:
        """Close the channel and the port."""
        try:
            self._put(b"C\r")
        finally:
            with self._sending:  # another file may get the number of a closed descriptor
                self._fd = -1
                self._serial.close()


def _bitrate_code(url: BusUrl) -> str | None:
    for key in url.options:
        if key not in _OPTIONS:
            raise BusError(f"{url}: unknown option {key!r}; allowed: {', '.join(_OPTIONS)}")
    bitrate: Any = url.options.get("bitrate")
    if bitrate is None:
        return None
    if bitrate not in BITRATE_CODES:
        known = ", ".join(str(rate) for rate in BITRATE_CODES)
        raise BusError(f"{url}: bitrate {bitrate}; allowed: {known}")
    return BITRATE_CODES[bitrate]


def _open_port(url: BusUrl, baud: Any) -> Any:
    path = url.channel
    try:
        return serial.Serial(path, baudrate=baud, timeout=0, exclusive=True)
    except (ValueError, TypeError):
        raise BusError(f"{url}: tty_baudrate {baud!r}: this port cannot be set to that") from None
    except serial.SerialException as error:
        reason = {
            errno.ENOENT: f"there is no serial port {path}; `ls /dev/serial/by-id` lists adapters",
            errno.ENODEV: f"there is no adapter at {path}",
            errno.ENXIO: f"there is no adapter at {path}",
            errno.EIO: f"the adapter at {path} is gone",
            errno.EACCES: f"no permission for {path}; join its group (dialout) and log in again",
            errno.EBUSY: f"{path} is in use by another program",
            errno.EWOULDBLOCK: f"{path} is in use by another program",
            errno.EISDIR: f"{path} is not a serial port",
        }.get(error.errno or 0)
        if reason is None and "configure" in str(error):
            reason = f"{path} is not a serial port"
        raise BusError(f"{url}: {reason or error}") from None

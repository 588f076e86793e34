"""The ASCII protocol of serial CAN adapters, from the adapter's side (Lawicel CAN232/CANUSB)."""

from __future__ import annotations

from collections.abc import Callable

from cdpr_sim_bus.frame import EFF_FLAG, EFF_MASK, FRAME, RTR_FLAG, SFF_MASK

BITRATES = (10_000, 20_000, 50_000, 100_000, 125_000, 250_000, 500_000, 800_000, 1_000_000)
"""What S0 to S8 stand for, bit/s."""

_OK, _BELL = b"\r", b"\a"
_VERSION, _SERIAL_NUMBER = b"V1013\r", b"NSIM1\r"
_CLOCK_HZ = 8_000_000  # of the SJA1000's time quanta, before the prescaler
_MINUTE_MS = 60_000
_LONGEST_LINE = 30
# flags of the answer to F
RX_FULL, TX_FULL, WARNING, OVERRUN = 0x01, 0x02, 0x04, 0x08
PASSIVE, BUS_ERROR = 0x20, 0x80


class LawicelAdapter:
    """Commands in, answers out; frames are 16 bytes, laid out as `struct can_frame`.

    An adapter opened at another bit rate than the bus has takes and gives no frames: nobody
    acknowledges what it sends, and it becomes error-passive.
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
        """Take characters from the serial line; return the commands that are whole now.

        A line longer than any command is cut, so that it is refused.
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
        """Carry out one command (without its CR) and return the answer."""
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
            self.flags = flags & (WARNING | PASSIVE)  # a state, which reading does not end
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

"""16-byte frames on a CAN network interface of Linux (SocketCAN)."""

from __future__ import annotations

import contextlib
import errno
import fcntl
import select
import socket
import struct
import time

from cdpr_drivers.bus.frames import BUFFER_BYTES, SEND_TIMEOUT_S, Bytes, Filters, FramePort
from cdpr_drivers.bus.health import ALL_ERRORS, BusHealth
from cdpr_drivers.bus.url import BusUrl
from cdpr_drivers.errors import BusError

_SIOCGIFFLAGS, _SIOCGIFHWADDR, _SIOCGSTAMPNS = 0x8913, 0x8927, 0x8907
_IFREQ = struct.Struct("16sH22x")
_TIMESPEC = struct.Struct("ll")
_IFF_UP = 0x1
_ARPHRD_CAN = 280
_SO_RCVBUFFORCE = 33
_CAN_RAW_ERR_FILTER = 2
_TRIES = 1000


class SocketCanPort(FramePort):
    """A `FramePort` on a raw CAN socket, filtered and time-stamped by the kernel."""

    def __init__(self, url: BusUrl, sock: socket.socket, health: BusHealth | None) -> None:
        super().__init__(url, sock, health)
        self.send = self._send_retrying

    def arrival_s(self) -> float:
        """Return the kernel's time stamp of the last frame taken, seconds since 1970.

        The stamp is read only on request, so that a cycle that does not need it does not pay for
        it.
        """
        try:
            stamp = fcntl.ioctl(self._sock, _SIOCGSTAMPNS, bytes(_TIMESPEC.size))
        except OSError:
            return time.time()  # no frame yet
        seconds, nanoseconds = _TIMESPEC.unpack(stamp)
        return float(seconds + nanoseconds * 1e-9)

    def set_filters(self, filters: Filters) -> None:
        """Receive only frames that pass one of `filters`, from now on."""
        packed = b"".join(struct.pack("=II", can_id, mask) for can_id, mask in filters)
        self._sock.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER, packed)

    def lost(self, error: OSError | None = None) -> BusError:
        """Return the BusError that says why the bus is not usable and what to do."""
        number = error.errno if error is not None else None
        if number == errno.ENOBUFS:
            return BusError(f"{self.url}: {_queue_full(self.url.channel)}")
        if number in (errno.ENETDOWN, errno.ENXIO, errno.ENODEV):
            problem = interface_problem(self.url) or "it went down for a moment"
            return BusError(f"{self.url}: the bus is lost: {problem}")
        return super().lost(error)

    def _send_retrying(self, frame: Bytes) -> int:
        """Send; wait while the transmit queue is full, because a CAN socket does not block then."""
        attempts = _TRIES
        while True:
            try:
                return self._sock.send(frame)
            except OSError as error:
                attempts -= 1
                if error.errno != errno.ENOBUFS:
                    raise
                self.health.note_tx_full()
                if not attempts:
                    raise
            select.select([], [], [], SEND_TIMEOUT_S / _TRIES)


def _queue_full(channel: str) -> str:
    return (
        f"the transmit queue of {channel} has been full for {SEND_TIMEOUT_S:g} s: no other node "
        "acknowledges (power, cable, bit rate), the controller is bus-off, or the queue is too "
        f"short ({channel}'s txqueuelen)"
    )


def open_socketcan(
    url: BusUrl,
    filters: Filters | None,
    health: BusHealth | None = None,
    *,
    receive_errors: bool = False,
) -> SocketCanPort:
    """Open a raw CAN socket on the network interface that `url` names.

    Raises:
        BusError: the kernel has no SocketCAN, the interface does not exist, or it is down.
    """
    problem = interface_problem(url)
    if problem:
        raise BusError(f"{url}: {problem}")
    sock = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
    try:
        _enlarge_buffer(sock)
        with contextlib.suppress(OSError):
            # this call fails because no frame has arrived, but the kernel stamps frames from now on
            fcntl.ioctl(sock, _SIOCGSTAMPNS, bytes(_TIMESPEC.size))
        port = SocketCanPort(url, sock, health)
        if filters is not None:
            port.set_filters(filters)
        if receive_errors:
            sock.setsockopt(socket.SOL_CAN_RAW, _CAN_RAW_ERR_FILTER, ALL_ERRORS)
        sock.bind((url.channel,))
    except OSError as error:
        sock.close()
        raise BusError(f"{url}: {url.channel} cannot be used ({error.strerror})") from None
    return port


def interface_problem(url: BusUrl) -> str:
    """Return why the network interface of `url` is not usable and what to do; "" if it is."""
    channel = url.channel
    try:
        sock = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
    except OSError as error:
        return f"this kernel has no SocketCAN ({error.strerror}); try: sudo modprobe can-raw"
    with sock:
        try:
            kind = _ask(sock, _SIOCGIFHWADDR, channel)
            flags = _ask(sock, _SIOCGIFFLAGS, channel)
        except OSError as error:
            return (
                f"there is no network interface {channel!r} ({error.strerror}); "
                f"CAN interfaces here: {', '.join(can_interfaces(sock)) or 'none'}"
            )
    if kind != _ARPHRD_CAN:
        return f"the network interface {channel!r} is not a CAN interface"
    if not flags & _IFF_UP:
        how = "" if channel.startswith("v") else " type can bitrate 1000000"
        return (
            f"the network interface {channel!r} is down; bring it up with: "
            f"sudo ip link set {channel} up{how}"
        )
    return ""


def can_interfaces(sock: socket.socket) -> list[str]:
    """Return the names of the machine's CAN network interfaces; `sock` is any CAN socket."""
    names = []
    for _, name in socket.if_nameindex():
        with contextlib.suppress(OSError):
            if _ask(sock, _SIOCGIFHWADDR, name) == _ARPHRD_CAN:
                names.append(name)
    return names


def _ask(sock: socket.socket, request: int, name: str) -> int:
    """Return the 16-bit answer to a query about a network interface; raises OSError."""
    answer = fcntl.ioctl(sock, request, _IFREQ.pack(name.encode(), 0))
    return int(_IFREQ.unpack(answer)[1])


def _enlarge_buffer(sock: socket.socket) -> None:
    """Enlarge the buffer to lose fewer frames; privileged processes may exceed the limit."""
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER_BYTES)
    with contextlib.suppress(PermissionError):
        sock.setsockopt(socket.SOL_SOCKET, _SO_RCVBUFFORCE, BUFFER_BYTES)

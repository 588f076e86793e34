"""The CAN interfaces of this machine, as the kernel tells of them over rtnetlink."""

from __future__ import annotations

import socket
import struct
from collections.abc import Iterator
from dataclasses import dataclass

# linux/rtnetlink.h, linux/if_link.h, linux/if_arp.h, linux/can/netlink.h
_RTM_NEWLINK, _RTM_GETLINK, _NLMSG_DONE = 16, 18, 3
_REQUEST_DUMP = 0x301
_TXQLEN, _IFNAME, _LINKINFO = 13, 3, 18
_INFO_KIND, _INFO_DATA = 1, 2
_BITTIMING, _STATE = 1, 4
_ARPHRD_CAN, _IFF_UP = 280, 1
_STATES = ("error-active", "error-warning", "error-passive", "bus-off", "stopped", "sleeping")
_NESTED = 0x3FFF  # without the flags of an attribute's type

_MESSAGE = struct.Struct("=IHHII")
_LINK = struct.Struct("=BxHiII")
_ATTRIBUTE = struct.Struct("=HH")
_U32 = struct.Struct("=I")


@dataclass(frozen=True)
class CanInterface:
    """One CAN interface; `state` is down, up where a controller has none to tell, or its own."""

    name: str
    is_up: bool
    is_virtual: bool
    queue_frames: int
    state: str
    bitrate_bit_s: int = 0


def list_interfaces() -> list[CanInterface]:
    """Return the CAN interfaces there are; none where the kernel cannot be asked."""
    try:
        with socket.socket(socket.AF_NETLINK, socket.SOCK_RAW, socket.NETLINK_ROUTE) as kernel:
            size = _MESSAGE.size + _LINK.size
            head = _MESSAGE.pack(size, _RTM_GETLINK, _REQUEST_DUMP, 1, 0)
            kernel.send(head + _LINK.pack(socket.AF_UNSPEC, 0, 0, 0, 0))
            return list(_answers(kernel))
    except OSError:
        return []


def _answers(kernel: socket.socket) -> Iterator[CanInterface]:
    while True:
        data = kernel.recv(1 << 17)
        while len(data) >= _MESSAGE.size:
            size, kind, *_ = _MESSAGE.unpack_from(data)
            if kind != _RTM_NEWLINK:
                return
            interface = parse_link(data[_MESSAGE.size : size])
            if interface is not None:
                yield interface
            data = data[size + -size % 4 :]


def parse_link(data: bytes) -> CanInterface | None:
    """Return what an RTM_NEWLINK message tells, without its header; None unless it is CAN."""
    _, kind, _, flags, _ = _LINK.unpack_from(data)
    if kind != _ARPHRD_CAN:
        return None
    found = _attributes(data[_LINK.size :])
    info = _attributes(found.get(_LINKINFO, b""))
    own = _attributes(info.get(_INFO_DATA, b""))
    is_up = bool(flags & _IFF_UP)
    state = "up" if is_up else "down"
    if is_up and _STATE in own:
        state = _STATES[min(_number(own[_STATE]), len(_STATES) - 1)]
    return CanInterface(
        name=found.get(_IFNAME, b"").rstrip(b"\0").decode(errors="replace"),
        is_up=is_up,
        is_virtual=info.get(_INFO_KIND, b"").rstrip(b"\0") != b"can",
        queue_frames=_number(found.get(_TXQLEN, b"")),
        state=state,
        bitrate_bit_s=_number(own.get(_BITTIMING, b"")),
    )


def _number(data: bytes) -> int:
    return int(_U32.unpack_from(data)[0]) if len(data) >= _U32.size else 0


def _attributes(data: bytes) -> dict[int, bytes]:
    found: dict[int, bytes] = {}
    while len(data) >= _ATTRIBUTE.size:
        size, kind = _ATTRIBUTE.unpack_from(data)
        if size < _ATTRIBUTE.size:
            break
        found[kind & _NESTED] = data[_ATTRIBUTE.size : size]
        data = data[size + -size % 4 :]
    return found

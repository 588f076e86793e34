"""Sockets to listen at, independent of the servers."""

from __future__ import annotations

import ipaddress
import os
import socket
import stat
import struct
from pathlib import Path

from cdpr_rt.errors import ControlError

_CREDENTIALS = struct.Struct("iII")


class ListenError(ControlError):
    """The process cannot listen at an address; the message gives the address and the reason."""


def listen_unix(path: Path) -> socket.socket:
    """Return a socket at `path` to which only this user may connect; raises ListenError.

    The socket of a killed daemon is replaced; that of a daemon that answers is kept.
    """
    try:
        if path.exists() or path.is_symlink():
            if not stat.S_ISSOCK(path.lstat().st_mode):
                raise ListenError(f"socket {path}: is not a socket")
            if listener_pid(path) is not None:
                raise ListenError(f"socket {path}: another daemon listens there")
            path.unlink()
    except OSError as error:  # the socket is another user's, in a folder for all users
        raise ListenError(f"socket {path}: {error.strerror or error}") from None
    listener = socket.socket(socket.AF_UNIX)
    mask = os.umask(0o177)
    try:
        listener.bind(str(path))
        listener.listen()  # as soon as the socket is visible, clients can connect
    except OSError as error:
        listener.close()
        raise ListenError(f"socket {path}: {error.strerror or error}") from None
    finally:
        os.umask(mask)
    return listener


def listen_tcp(host: str, port: int) -> socket.socket:
    """Return a socket at one address of `host`; raises ListenError."""
    listener = _bound(host, port, socket.SOCK_STREAM)
    try:
        listener.listen()  # before this call, another process could bind the same address
    except OSError as error:
        listener.close()
        raise ListenError(f"{host}:{port}: {error.strerror or error}") from None
    return listener


def listen_udp(host: str, port: int, *, has_key: bool = False) -> socket.socket:
    """Return a socket for a set-point stream at `host` and `port` (0: any free port).

    The holder of the stream may later get a second socket at the same address. Raises ListenError,
    also if other machines can reach the address and there is no key.
    """
    sock = _bound(host, port, socket.SOCK_DGRAM)
    if not has_key and not ipaddress.ip_address(sock.getsockname()[0]).is_loopback:
        sock.close()
        raise ListenError(f"{host}:{port}: others can reach it; give a key, or listen at 127.0.0.1")
    # set after binding, so that binding fails if another process listens at this address
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
    return sock


def _bound(host: str, port: int, kind: socket.SocketKind) -> socket.socket:
    try:
        family, _, proto, _, address = socket.getaddrinfo(
            host, port, type=kind, flags=socket.AI_PASSIVE
        )[0]
        # asyncio sends without delay only if the socket says that it is TCP
        sock = socket.socket(family, kind, proto)
    except (OSError, UnicodeError) as error:
        reason = getattr(error, "strerror", None) or error
        raise ListenError(f"{host}:{port}: {reason}") from None
    if kind is socket.SOCK_STREAM:
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        sock.bind(address)
    except OSError as error:
        sock.close()
        raise ListenError(f"{host}:{port}: {error.strerror or error}") from None
    return sock


def listener_pid(path: Path) -> int | None:
    """Return the process that listens at the Unix socket `path`, None if none does.

    Returns 0 if the process is unknown, because this user may not connect or too many clients wait.
    """
    with socket.socket(socket.AF_UNIX) as probe:
        probe.settimeout(1.0)
        try:
            probe.connect(str(path))
        except (ConnectionRefusedError, FileNotFoundError):
            return None
        except OSError:
            return 0
        credentials = probe.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
    pid, _, _ = _CREDENTIALS.unpack(credentials)
    return int(pid)

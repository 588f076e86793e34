"""Sockets to listen at, apart from what is served there."""

from __future__ import annotations

import errno
import os
import socket
import stat
from pathlib import Path

from cdpr_rt.errors import ControlError


class ListenError(ControlError):
    """An address cannot be listened at; the message says which and why."""


def listen_unix(path: Path) -> socket.socket:
    """Return a socket at `path` that this user alone may connect to; raises ListenError.

    What a daemon that was killed has left there is replaced, a daemon that answers is not.
    """
    try:
        if path.exists() or path.is_symlink():
            if not stat.S_ISSOCK(path.lstat().st_mode):
                raise ListenError(f"socket {path}: is something else than a socket")
            if _answers(path):
                raise ListenError(f"socket {path}: another daemon listens there")
            path.unlink()
    except OSError as error:  # somebody else's, in a folder where all may write
        raise ListenError(f"socket {path}: {error.strerror or error}") from None
    listener = socket.socket(socket.AF_UNIX)
    mask = os.umask(0o177)
    try:
        listener.bind(str(path))
        listener.listen()  # whoever sees the socket can connect
    except OSError as error:
        listener.close()
        raise ListenError(f"socket {path}: {error.strerror or error}") from None
    finally:
        os.umask(mask)
    return listener


def listen_tcp(host: str, port: int) -> socket.socket:
    """Return a socket at one address of `host`; raises ListenError."""
    try:
        family, kind, proto, _, address = socket.getaddrinfo(
            host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
        listener = socket.socket(family, kind, proto)
    except OSError as error:
        raise ListenError(f"{host}:{port}: {error.strerror or error}") from None
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind(address)
        listener.listen()  # before that, another could bind the same
    except OSError as error:
        listener.close()
        raise ListenError(f"{host}:{port}: {error.strerror or error}") from None
    return listener


def _answers(path: Path) -> bool:
    with socket.socket(socket.AF_UNIX) as probe:
        probe.settimeout(1.0)
        failed = probe.connect_ex(str(path))
    return failed not in (errno.ECONNREFUSED, errno.ENOENT)

"""A lock for the one master of a bus on a machine, which the kernel frees with its process."""

from __future__ import annotations

import hashlib
import socket
import struct
from pathlib import Path
from typing import Self

from cdpr_drivers.bus.url import BusUrl
from cdpr_drivers.errors import BusError

_PREFIX = "\0cdpr-rt/master/"
_LONGEST_NAME = 80
_CREDENTIALS = struct.Struct("iII")


class MasterLock:
    """The right of this process to command the nodes on `url`, until `close` or its end.

    It is an abstract socket, so that nothing is left behind by a process that was killed. Programs
    in other containers with a network of their own, and on other machines, do not see it: boot
    listens for those. Raises BusError, with the other's process, where there is one.
    """

    def __init__(self, url: BusUrl) -> None:
        self._sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            self._sock.bind(_address(url))
            self._sock.listen()
        except OSError as error:
            self._sock.close()
            raise BusError(f"{url}: {_taken(url) or error.strerror}") from None

    def close(self) -> None:
        """Let another process have it; a second time does nothing."""
        self._sock.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def refuse_second_master(url: BusUrl) -> None:
    """Raise BusError where a process of this machine commands the nodes on `url`."""
    taken = _taken(url)
    if taken:
        raise BusError(f"{url}: {taken}")


def _taken(url: BusUrl) -> str:
    """Return which process commands the bus, empty where none of this machine does."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as caller:
        caller.setblocking(False)
        try:
            caller.connect(_address(url))
        except ConnectionRefusedError:
            return ""
        except OSError:
            return "another process runs the drives on this bus"  # and takes no more callers
        credentials = caller.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
    pid, _, _ = _CREDENTIALS.unpack(credentials)
    return f"process {pid}{_command_of(pid)} runs the drives on this bus; end that first"


def _command_of(pid: int) -> str:
    try:
        words = Path(f"/proc/{pid}/cmdline").read_bytes().decode(errors="replace").split("\0")
    except OSError:
        return ""
    command = " ".join(" ".join([Path(words[0]).name, *words[1:]]).split())
    return f" ({command[:_LONGEST_NAME]})" if command else ""


def _address(url: BusUrl) -> str:
    """Return the lock's name: the same for all ways to write a bus that is one wire here."""
    channel = url.channel
    if channel.startswith("/"):
        channel = str(Path(channel).resolve())
    host = f"//{url.options['host']}:{url.options['port']}/" if "host" in url.options else ""
    name = f"{url.interface}:{host}{channel}"
    if len(name.encode()) > _LONGEST_NAME:
        name = hashlib.sha256(name.encode()).hexdigest()
    return _PREFIX + name

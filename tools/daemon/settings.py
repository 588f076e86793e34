"""The settings of a daemon, checked once and passed to its processes as JSON."""

from __future__ import annotations

import fcntl
import ipaddress
import os
import re
import socket
import stat
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from secrets import token_urlsafe
from typing import Annotated, Self
from urllib.parse import quote

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from cdpr_profiles.bounded_input import open_regular, path_of
from cdpr_profiles.errors import ProfileError
from cdpr_rt.service.listening import ListenError, listen_tcp, listen_udp
from cdpr_rt.service.retention import Retention
from cdpr_tools.composition.own_code import OwnCodeOptions
from cdpr_tools.errors import BadInputError, WorkFailedError

_SECRET_CHARS, _MOST_KEY_BYTES = 16, 4096
_ALL_SEALS = fcntl.F_SEAL_WRITE | fcntl.F_SEAL_GROW | fcntl.F_SEAL_SHRINK | fcntl.F_SEAL_SEAL
_OPEN_TO_OTHERS = stat.S_IRWXG | stat.S_IRWXO
_HIGHEST_PORT = 65535
_PAGE_PORTS = range(8400, 8420)
_LIVE_HOST = "127.0.0.1"
_ORIGIN = re.compile(r"https?://[a-z0-9.-]+(:\d{1,5})?", re.IGNORECASE)


def is_loopback(host: str) -> bool:
    """Whether only this machine can reach `host`."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def checked_origin(origin: str) -> str:
    """Return the origin of a web page; raises BadInputError if it is not a browser's origin."""
    if not _ORIGIN.fullmatch(origin):
        raise BadInputError(
            f"--live-origin {origin}: allowed: the origin of a web page without a path, "
            "such as https://app.foxglove.dev or http://localhost:8080"
        )
    return origin.lower()


class Address(BaseModel):
    """A host and port to listen at."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    host: str = Field(min_length=1)
    port: int = Field(ge=0, le=_HIGHEST_PORT)

    @classmethod
    def parse(cls, option: str, text: str) -> Address:
        """Parse the value of `option`: HOST:PORT, [HOST]:PORT or PORT alone (loopback).

        Port 0 is any free port. Raises BadInputError.
        """
        host, _, port = text.rpartition(":")
        host = host.removeprefix("[").removesuffix("]") or "127.0.0.1"
        is_port = port.isascii() and port.isdigit() and int(port) <= _HIGHEST_PORT
        if not is_port or "[" in host or "]" in host:
            raise BadInputError(f"{option} {text}: allowed: HOST:PORT, [IPV6]:PORT or PORT alone")
        return cls(host=host, port=int(port))

    @property
    def is_loopback(self) -> bool:
        """Whether only this machine can reach it."""
        return is_loopback(self.host)

    def __str__(self) -> str:
        return f"{f'[{self.host}]' if ':' in self.host else self.host}:{self.port}"


def _absolute(path: Path) -> Path:
    return path_of(Path(), str(path)).absolute()


_Path = Annotated[Path, AfterValidator(_absolute)]


class RunSettings(BaseModel):
    """One daemon: its robot, its buses, and its addresses.

    The launcher makes it from the command line; both child processes get it as only argument.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", ser_json_inf_nan="constants")

    robot: str
    """The reference with which `load_robot` finds the robot."""
    name: str
    """The robot's short name, part of the names of its socket and its recordings."""
    buses: tuple[str, ...] = ()
    """Values of --bus; never `simbus:` alone, because its simulator already has a name."""
    simulated: bool = False
    """Whether all buses are simulated; files that such a robot leaves are kept separately."""
    own_simulator: bool = False
    """Whether the drives belong to a simulator that starts and ends with this daemon."""
    plant: _Path | None = None
    """Plant file of that simulator."""
    camera: _Path | None = None
    """Socket of its simulated camera."""
    read_only: bool = False
    commissioned: _Path | None = None
    """Folder with the cogging profiles of the axes' motors."""
    own: OwnCodeOptions = OwnCodeOptions()
    """The user's own code that the loop runs."""
    safety_io: str | None = None
    tension_port: str | None = None
    """Serial port of the robot's tension sensors."""
    socket: _Path
    http: Address | None = None
    http_asked: bool = False
    """Whether the user gave `http`, for programs other than the page. If so, everybody may read,
    hold and disable there, on loopback without a key file."""
    key_file: _Path | None = None
    record: _Path | None = None
    """Folder for recordings; None to record nothing."""
    keep: Retention = Retention()
    """Rules for which recordings to keep in that folder."""
    live: int | None = Field(default=None, ge=0, le=_HIGHEST_PORT)
    """Port of the live view, on loopback."""
    live_origins: tuple[str, ...] = ()
    """Web pages that may use the live view, in the form of `Origin`."""
    stream: Address | None = None
    """Address of the set-point stream."""
    launcher_pid: int = 0
    block_fd: int = -1
    """The shared memory's descriptor, inherited under the same number."""
    lock_fd: int = -1
    """Lock that marks the robot as in use, held until the last process that inherits it ends."""
    key_fd: int = -1
    """The key's descriptor, inherited only by the service, instead of `key_file`."""
    page_key_fd: int = -1
    """Descriptor of the page's key, made for this daemon; also inherited by the service."""
    http_fd: int = -1
    stream_fd: int = -1
    live_fd: int = -1
    """Sockets at `http`, `stream` and `live`, also inherited by the service."""

    @model_validator(mode="after")
    def _reachable_with_key_only(self) -> Self:
        for option, address in (("--http", self.http), ("--stream", self.stream)):
            if address is not None and not address.is_loopback and not self.has_key:
                raise BadInputError(
                    f"{option} {address}: others can reach it; give a --key-file, or listen at "
                    "127.0.0.1"
                )
        if self.key_file is not None:
            read_key(self.key_file)
        return self

    @property
    def has_key(self) -> bool:
        """Whether there is a shared key."""
        return self.key_file is not None or self.key_fd >= 0

    def with_key_loaded(self) -> RunSettings:
        """Return settings that contain the key; its file is read now, once.

        Without a file, the page gets a separate key. Processes started later inherit the key in
        sealed memory, even if the file changes. Raises BadInputError.
        """
        if self.key_file is not None:
            fd = _sealed(read_key(self.key_file))
            return self.model_copy(update={"key_file": None, "key_fd": fd})
        if self.http is not None:
            return self.model_copy(update={"page_key_fd": _sealed(token_urlsafe(24).encode())})
        return self

    def with_ports_bound(self) -> RunSettings:
        """Return settings with sockets at `http`, `stream` and `live`, which are bound now, once.

        So no other process can take a trusted port while the service restarts. Raises
        WorkFailedError.
        """
        asked: list[tuple[str, str, Address | None, Callable[[str, int], socket.socket]]] = [
            ("--http", "http_fd", self.http, listen_tcp if self.http_asked else _listen_page),
            ("--live", "live_fd", self._live_address, listen_tcp),
            ("--stream", "stream_fd", self.stream, partial(listen_udp, has_key=self.has_key)),
        ]
        bound: dict[str, int] = {}
        for option, key, at, listen in asked:
            try:
                bound[key] = -1 if at is None else listen(at.host, at.port).detach()
            except ListenError as error:
                raise WorkFailedError(f"{option} {error}") from None
        return self.model_copy(update=bound)

    @property
    def _live_address(self) -> Address | None:
        return None if self.live is None else Address(host=_LIVE_HOST, port=self.live)

    def page_url(self) -> str:
        """Return the page's address with its key, "" if nothing listens on TCP."""
        if self.http is None:
            return ""
        with socket.socket(fileno=os.dup(self.http_fd)) as listener:
            at = Address(host=self.http.host, port=listener.getsockname()[1])
        if at.host in ("0.0.0.0", "::"):  # every address of this machine
            at = Address(host=socket.gethostname(), port=at.port)
        return f"http://{at}/#key={quote(self.page_key() or b'', safe='')}"

    @property
    def shared_fds(self) -> tuple[int, ...]:
        """The descriptors that loop and service inherit."""
        return tuple(fd for fd in (self.block_fd, self.lock_fd) if fd >= 0)

    @property
    def service_fds(self) -> tuple[int, ...]:
        """The descriptors that each service inherits in addition to that of the shared memory."""
        fds = (self.key_fd, self.page_key_fd, self.http_fd, self.stream_fd, self.live_fd)
        return tuple(fd for fd in fds if fd >= 0)

    def key(self) -> bytes | None:
        """Return the shared key stored by the launcher, or None."""
        return None if self.key_fd < 0 else os.pread(self.key_fd, _MOST_KEY_BYTES, 0)

    def page_key(self) -> bytes | None:
        """Return the key for the page and other clients over TCP, or None."""
        fd = self.key_fd if self.key_fd >= 0 else self.page_key_fd
        return None if fd < 0 else os.pread(fd, _MOST_KEY_BYTES, 0)

    @classmethod
    def from_argv(cls) -> RunSettings:
        """Return the settings that the launcher passed to this process."""
        return cls.model_validate_json(sys.argv[1])


def _listen_page(host: str, port: int) -> socket.socket:
    """Return a socket at the first free port of `_PAGE_PORTS`, which browsers can remember."""
    for usual in () if port else _PAGE_PORTS:
        with suppress(ListenError):
            return listen_tcp(host, usual)
    return listen_tcp(host, port)


def _sealed(key: bytes) -> int:
    """Return the descriptor of memory that holds the key and that nobody can change."""
    fd = os.memfd_create("cdpr-rt-key", os.MFD_CLOEXEC | os.MFD_ALLOW_SEALING)
    os.write(fd, key)
    fcntl.fcntl(fd, fcntl.F_ADD_SEALS, _ALL_SEALS)
    return fd


def read_key(path: Path) -> bytes:
    """Return the shared secret, the first line of a file that only its owner may read.

    Raises BadInputError.
    """
    try:
        with os.fdopen(open_regular(path), "rb") as file:
            mode = os.fstat(file.fileno()).st_mode
            text = file.read(_MOST_KEY_BYTES + 1)
    except ProfileError as error:
        raise BadInputError(f"--key-file {error}") from None
    except OSError as error:
        raise BadInputError(f"--key-file {path}: cannot be read: {error.strerror}") from None
    if mode & _OPEN_TO_OTHERS:
        raise BadInputError(f"--key-file {path}: others may read it; allowed: chmod 600 {path}")
    if len(text) > _MOST_KEY_BYTES:
        raise BadInputError(
            f"--key-file {path}: is too long; allowed: up to {_MOST_KEY_BYTES} bytes"
        )
    key = text.split(b"\n", 1)[0].strip()
    if len(key) < _SECRET_CHARS or not key.isascii():
        raise BadInputError(
            f"--key-file {path}: {len(key)} characters; allowed: {_SECRET_CHARS} to "
            f"{_MOST_KEY_BYTES} ASCII characters, for example from `openssl rand -hex 32`"
        )
    return key

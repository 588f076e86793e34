"""What a daemon is asked to do, checked once and handed to its processes as JSON."""

from __future__ import annotations

import fcntl
import ipaddress
import os
import re
import stat
import sys
from pathlib import Path
from typing import Annotated, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from cdpr_profiles.errors import ProfileError
from cdpr_profiles.reading.bounded_input import open_regular
from cdpr_rt.service.listening import ListenError, listen_tcp
from cdpr_rt.service.recordings.retention import Retention
from cdpr_rt.service.streams.setpoint_stream import StreamError, listen_udp
from cdpr_tools.errors import BadInputError, WorkFailedError

_SECRET_CHARS, _MOST_KEY_BYTES = 16, 4096
_ALL_SEALS = fcntl.F_SEAL_WRITE | fcntl.F_SEAL_GROW | fcntl.F_SEAL_SHRINK | fcntl.F_SEAL_SEAL
_OPEN_TO_OTHERS = stat.S_IRWXG | stat.S_IRWXO
_HIGHEST_PORT = 65535
_LIVE_HOST = "127.0.0.1"
_ORIGIN = re.compile(r"https?://[a-z0-9.-]+(:\d{1,5})?", re.IGNORECASE)


def is_loopback(host: str) -> bool:
    """Whether only this machine can reach `host`."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def checked_origin(origin: str) -> str:
    """Return the origin of a web page; raises BadInputError for what no browser names so."""
    if not _ORIGIN.fullmatch(origin):
        raise BadInputError(
            f"--live-origin {origin}: allowed: where a web page is from, such as "
            "https://app.foxglove.dev or http://localhost:8080, without a path"
        )
    return origin.lower()


class Address(BaseModel):
    """A host and port to listen at."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    host: str = Field(min_length=1)
    port: int = Field(ge=0, le=_HIGHEST_PORT)

    @classmethod
    def parse(cls, option: str, text: str) -> Address:
        """Return what `option` was given as HOST:PORT, [HOST]:PORT or PORT alone (loopback).

        Port 0 is any that is free. Raises BadInputError.
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
    return path.expanduser().absolute()


_Path = Annotated[Path, AfterValidator(_absolute)]


class RunSettings(BaseModel):
    """One daemon: its robot, its buses, and how it is reached.

    The launcher makes it of the command line; both child processes get it as their only argument.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", ser_json_inf_nan="constants")

    robot: str
    """What `load_robot` finds the robot by."""
    name: str
    """The robot's short name, in the names of its socket and its recordings."""
    buses: tuple[str, ...] = ()
    """What was given with --bus; never `simbus:` alone, its simulator has a name already."""
    simulated: bool = False
    """Whether all buses are simulated; what such a robot leaves for later is kept by itself."""
    own_simulator: bool = False
    """Whether the drives are a simulator's that begins and ends with this daemon."""
    read_only: bool = False
    commissioned: _Path | None = None
    """Folder with the cogging profiles of the axes' motors."""
    safety_io: str | None = None
    tension_port: str | None = None
    """Serial port at which the robot's tension sensors are."""
    socket: _Path
    http: Address | None = None
    key_file: _Path | None = None
    record: _Path | None = None
    """Folder for recordings, None to record nothing."""
    keep: Retention = Retention()
    """Which recordings stay in that folder."""
    live: int | None = Field(default=None, ge=0, le=_HIGHEST_PORT)
    """Port of the live view, on loopback."""
    live_origins: tuple[str, ...] = ()
    """Web pages that may look at the live view, as `Origin` names them."""
    stream: Address | None = None
    """Where the set-point stream is received."""
    launcher_pid: int = 0
    block_fd: int = -1
    """The shared memory's descriptor, inherited under the same number."""
    key_fd: int = -1
    """The key's descriptor, inherited by the service alone, in place of `key_file`."""
    http_fd: int = -1
    stream_fd: int = -1
    live_fd: int = -1
    """Sockets at `http`, `stream` and `live`, which the service inherits as well."""

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
        """Return settings that do not need the key's file: it is read now, once.

        Processes that are started later inherit the key in sealed memory, whatever becomes of the
        file. Raises BadInputError.
        """
        if self.key_file is None:
            return self
        key = read_key(self.key_file)
        fd = os.memfd_create("cdpr-rt-key", os.MFD_CLOEXEC | os.MFD_ALLOW_SEALING)
        os.write(fd, key)
        fcntl.fcntl(fd, fcntl.F_ADD_SEALS, _ALL_SEALS)
        return self.model_copy(update={"key_file": None, "key_fd": fd})

    def with_ports_bound(self) -> RunSettings:
        """Return settings with sockets at `http`, `stream` and `live`: they are bound now, once.

        Between two services nobody else gets a port that clients trust. Raises WorkFailedError.
        """
        http_fd = stream_fd = live_fd = -1
        option = "--http"
        try:
            if self.http is not None:
                http_fd = listen_tcp(self.http.host, self.http.port).detach()
            option = "--live"
            if self.live is not None:
                live_fd = listen_tcp(_LIVE_HOST, self.live).detach()
            if self.stream is not None:
                host, port = self.stream.host, self.stream.port
                stream_fd = listen_udp(host, port, self.has_key).detach()
        except ListenError as error:
            raise WorkFailedError(f"{option} {error}") from None
        except StreamError as error:
            raise WorkFailedError(f"--stream: {error}") from None
        return self.model_copy(
            update={"http_fd": http_fd, "stream_fd": stream_fd, "live_fd": live_fd}
        )

    @property
    def service_fds(self) -> tuple[int, ...]:
        """The descriptors that each service inherits, beside the shared memory's."""
        fds = (self.key_fd, self.http_fd, self.stream_fd, self.live_fd)
        return tuple(fd for fd in fds if fd >= 0)

    def key(self) -> bytes | None:
        """Return the shared key that the launcher has kept, None where there is none."""
        return None if self.key_fd < 0 else os.pread(self.key_fd, _MOST_KEY_BYTES, 0)

    @classmethod
    def from_argv(cls) -> RunSettings:
        """Return what the launcher gave this process."""
        return cls.model_validate_json(sys.argv[1])


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
            f"{_MOST_KEY_BYTES} of ASCII, such as `openssl rand -hex 32` writes"
        )
    return key

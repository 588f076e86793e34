"""Bus URLs, and the lock for the one master of the bus that a URL names."""

from __future__ import annotations

import hashlib
import re
import socket
import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import Self
from urllib.parse import parse_qsl, quote

from cdpr_drivers.errors import BusError

ALLOWED = (
    "allowed: simbus:NAME, socketcan:vcan0, slcan:/dev/ttyACM0?bitrate=1000000, "
    "socketcand://host:port/can0, or interface:channel?key=value of python-can"
)
Option = str | int | float | bool

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}")
_URL = re.compile(r"(?P<interface>[A-Za-z0-9_-]+):(?P<rest>.*)", re.DOTALL)
_REMOTE = re.compile(r"//(?P<host>\[[^\]]+\]|[^/:]+):(?P<port>\d+)/(?P<channel>[^/]+)")


@dataclass(frozen=True)
class BusUrl:
    """A parsed bus URL: interface, channel and further options of the interface."""

    interface: str
    channel: str
    options: dict[str, Option] = field(default_factory=dict)

    @classmethod
    def parse(cls, text: str) -> BusUrl:
        """Parse `text`.

        Raises:
            BusError: the text names no bus; the message lists the allowed forms.
        """
        match = _URL.fullmatch(text.strip())
        if match is None:
            raise BusError(f"bus {text!r}: an interface and a colon are missing; {ALLOWED}")
        interface = match["interface"].lower()
        rest, _, query = match["rest"].partition("?")
        options = _options(text, query)
        if interface == "simbus":
            return cls(interface, _simbus_name(text, rest, options))
        # imported here: it loads slowly, and simulated buses do not need it
        import can  # noqa: PLC0415

        if interface not in can.VALID_INTERFACES:
            known = ", ".join(sorted(can.VALID_INTERFACES))
            raise BusError(
                f"bus {text!r}: unknown interface {interface!r}; {ALLOWED} (one of {known})"
            )
        if interface == "socketcand":
            return _socketcand(text, rest, options)
        if not rest:
            raise BusError(f"bus {text!r}: the channel after the colon is missing; {ALLOWED}")
        if interface == "socketcan" and (len(rest) > 15 or "/" in rest):
            raise BusError(
                f"bus {text!r}: {rest!r} cannot be a network interface (at most 15 characters, "
                "no '/'), for example socketcan:vcan0"
            )
        return cls(interface, rest, options)

    @property
    def starts_own_simulator(self) -> bool:
        """Whether the command must start its own simulator (`simbus:` without a name)."""
        return self.interface == "simbus" and not self.channel

    @property
    def is_simulated(self) -> bool:
        """Whether only simulated motors can be on this bus."""
        return self.interface == "simbus"

    @property
    def asks_for_lockstep(self) -> bool:
        """Whether the simulator behind a virtual CAN interface runs in lockstep."""
        return self.options.get("lockstep") is True

    def __str__(self) -> str:
        options = dict(self.options)
        start = f"{self.interface}:"
        if self.interface == "socketcand":
            host = str(options.pop("host"))
            start += f"//{f'[{host}]' if ':' in host else host}:{options.pop('port')}/"
        query = "&".join(f"{key}={_text(value)}" for key, value in options.items())
        return start + self.channel + (f"?{query}" if query else "")


def _simbus_name(text: str, rest: str, options: dict[str, Option]) -> str:
    if options:
        raise BusError(f"bus {text!r}: a simbus has no options; allowed: simbus:NAME or simbus:")
    if rest and _NAME.fullmatch(rest) is None:
        raise BusError(
            f"bus {text!r}: a simbus name has 1 to 64 letters, digits, '_', '.' or '-' and "
            "begins with a letter or digit"
        )
    return rest


def _socketcand(text: str, rest: str, options: dict[str, Option]) -> BusUrl:
    match = _REMOTE.fullmatch(rest)
    if match is None or not 0 < int(match["port"]) < 65536:
        raise BusError(f"bus {text!r}: write it as socketcand://host:port/can0")
    remote: dict[str, Option] = {"host": match["host"].strip("[]"), "port": int(match["port"])}
    return BusUrl("socketcand", match["channel"], remote | options)


def _options(text: str, query: str) -> dict[str, Option]:
    try:
        pairs = parse_qsl(query, keep_blank_values=False, strict_parsing=bool(query))
    except ValueError:
        raise BusError(f"bus {text!r}: write options as ?key=value&key=value") from None
    return {key: _value(value) for key, value in pairs}


def _text(value: Option) -> str:
    return str(value).lower() if isinstance(value, bool) else quote(str(value), safe="/:@,;")


def _value(text: str) -> Option:
    if text.lower() in ("true", "false"):
        return text.lower() == "true"
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text


_PREFIX = "\0cdpr-rt/master/"
_LONGEST_NAME = 80
_CREDENTIALS = struct.Struct("iII")


class MasterLock:
    """The right of this process to command the nodes on `url`, until `close` or process end.

    It is an abstract socket, so that a killed process leaves nothing behind. Masters in
    containers with their own network and on other machines do not see it; boot listens for
    their frames. Raises BusError, which names the other process, if another one has the lock.
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
        """Release the lock for other processes; a second call does nothing."""
        self._sock.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def refuse_second_master(url: BusUrl) -> None:
    """Raise BusError if a process of this machine commands the nodes on `url`."""
    taken = _taken(url)
    if taken:
        raise BusError(f"{url}: {taken}")


def _taken(url: BusUrl) -> str:
    """Return which process commands the bus; empty if none of this machine does."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as caller:
        caller.setblocking(False)
        try:
            caller.connect(_address(url))
        except ConnectionRefusedError:
            return ""
        except OSError:
            return "another process runs the drives on this bus"  # its queue is full
        credentials = caller.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
    pid, _, _ = _CREDENTIALS.unpack(credentials)
    return f"process {pid}{_command_of(pid)} runs the drives on this bus; end that process first"


def _command_of(pid: int) -> str:
    try:
        words = Path(f"/proc/{pid}/cmdline").read_bytes().decode(errors="replace").split("\0")
    except OSError:
        return ""
    command = " ".join(" ".join([Path(words[0]).name, *words[1:]]).split())
    return f" ({command[:_LONGEST_NAME]})" if command else ""


def _address(url: BusUrl) -> str:
    """Return the lock's name, the same for all URLs of one physical bus of this machine."""
    channel = url.channel
    if channel.startswith("/"):
        channel = str(Path(channel).resolve())
    host = f"//{url.options['host']}:{url.options['port']}/" if "host" in url.options else ""
    name = f"{url.interface}:{host}{channel}"
    if len(name.encode()) > _LONGEST_NAME:
        name = hashlib.sha256(name.encode()).hexdigest()
    return _PREFIX + name

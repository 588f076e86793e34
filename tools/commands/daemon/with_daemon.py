"""The options of all commands that talk to a running daemon."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from cdpr_tools.client.client import Daemon, open_daemon
from cdpr_tools.client.starting import await_socket, await_start
from cdpr_tools.commands.option_decorator import shares
from cdpr_tools.commands.options import (
    JsonOption,
    KeyFileOption,
    RobotOption,
    SocketOption,
    UrlOption,
)
from cdpr_tools.output import Output


@shares
@contextmanager
def with_daemon_at_once(
    robot: RobotOption = None,
    socket: SocketOption = None,
    url: UrlOption = None,
    key_file: KeyFileOption = None,
    as_json: JsonOption = False,
) -> Iterator[tuple[Daemon, Output]]:
    """Give a command the daemon that these options name, and where to write to."""
    with open_daemon(robot, socket, url, key_file) as daemon:
        yield daemon, Output(as_json)


@shares
@contextmanager
def with_daemon(
    robot: RobotOption = None,
    socket: SocketOption = None,
    url: UrlOption = None,
    key_file: KeyFileOption = None,
    as_json: JsonOption = False,
) -> Iterator[tuple[Daemon, Output]]:
    """Give it as `with_daemon_at_once` does, once the daemon has started."""
    out = Output(as_json)
    if url is None:
        await_socket(robot, socket, out)
    with open_daemon(robot, socket, url, key_file) as daemon:
        await_start(daemon, out)
        yield daemon, out

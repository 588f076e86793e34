"""The options of all commands that talk to a running daemon."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from cdpr_tools.client.client import Daemon, await_socket, await_start, open_daemon
from cdpr_tools.commands.options import (
    JsonOption,
    KeyFileOption,
    RobotOption,
    SocketOption,
    UrlOption,
    shares,
)
from cdpr_tools.output import Output


def _with_daemon(once_started: bool) -> Callable[[Callable[..., None]], Callable[..., None]]:
    @contextmanager
    def options(
        robot: RobotOption = None,
        socket: SocketOption = None,
        url: UrlOption = None,
        key_file: KeyFileOption = None,
        as_json: JsonOption = False,
    ) -> Iterator[tuple[Daemon, Output]]:
        out = Output(as_json)
        if once_started and url is None:
            await_socket(robot, socket, out)
        with open_daemon(robot, socket, url, key_file) as daemon:
            if once_started:
                await_start(daemon, out)
            yield daemon, out

    return shares(options)


with_daemon_at_once = _with_daemon(once_started=False)
"""Passes the daemon that these options name, and the output, to a command."""
with_daemon = _with_daemon(once_started=True)
"""Like `with_daemon_at_once`, but waits until the daemon has started."""

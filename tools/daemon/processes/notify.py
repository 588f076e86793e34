"""Notifications to systemd as of sd_notify(3), where it asks for them."""

from __future__ import annotations

import os
import socket
from collections.abc import Mapping
from typing import Final

# systemd takes datagrams of 4096 bytes; a character has up to 4
_MOST_CHARS: Final = 900


class ServiceManager:
    """The manager that started this process with Type=notify, if one did.

    Its variables are removed from the environment: children do not notify in our place.
    """

    def __init__(self) -> None:
        address = os.environ.pop("NOTIFY_SOCKET", "")
        microseconds = os.environ.pop("WATCHDOG_USEC", "")
        whose = os.environ.pop("WATCHDOG_PID", "")
        self._address = "\0" + address[1:] if address.startswith("@") else address
        self._pending: dict[str, str] = {}
        watched = microseconds.isdigit() and whose in ("", str(os.getpid()))
        self.watchdog_s = int(microseconds) / 1e6 if watched else 0.0
        """Watchdog time-out, 0 without a watchdog."""

    @property
    def asks(self) -> bool:
        """Whether a manager asks for notifications."""
        return bool(self._address)

    def notify(self, **fields: str | int) -> None:
        """Send assignments such as READY=1; what the manager does not take now is kept.

        Of each name the newest is kept, until `retry` finds that it is taken.
        """
        self._pending.update({key: _one_line(str(value)) for key, value in fields.items()})
        self.retry()

    def retry(self) -> None:
        """Send what the manager has not taken yet; never waits."""
        if self._pending and self._sent(self._pending):
            self._pending.clear()

    def feed(self) -> bool:
        """Feed the watchdog; return whether that was taken. It is of no use later."""
        return self._sent({"WATCHDOG": "1"})

    def _sent(self, fields: Mapping[str, str]) -> bool:
        if not self._address:
            return True
        text = "\n".join(f"{key}={value}" for key, value in fields.items())
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC) as speaker:
            try:
                speaker.sendto(text.encode(), socket.MSG_DONTWAIT, self._address)
            except OSError:  # its queue is full, or it is being started anew
                return False
        return True


def _one_line(text: str) -> str:
    """Return a value that is no second assignment, and that the manager has room for."""
    return " ".join(text.split())[:_MOST_CHARS]

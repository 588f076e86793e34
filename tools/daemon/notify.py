"""What systemd is told of the daemon, as sd_notify(3) describes it; nothing where nobody asks."""

from __future__ import annotations

import os
import socket


class ServiceManager:
    """The manager that started this process with Type=notify, if one did.

    What tells so is taken out of the environment: children do not speak for the daemon.
    """

    def __init__(self) -> None:
        address = os.environ.pop("NOTIFY_SOCKET", "")
        microseconds = os.environ.pop("WATCHDOG_USEC", "")
        whose = os.environ.pop("WATCHDOG_PID", "")
        self._address = "\0" + address[1:] if address.startswith("@") else address
        watched = microseconds.isdigit() and whose in ("", str(os.getpid()))
        self.watchdog_s = int(microseconds) / 1e6 if watched else 0.0
        """Silence of this length has the daemon restarted; 0 where nobody watches."""

    @property
    def asks(self) -> bool:
        """Whether somebody wants to be told."""
        return bool(self._address)

    def tell(self, **fields: str | int) -> None:
        """Send assignments such as READY=1; a manager that has gone is not missed."""
        if not self._address:
            return
        text = "\n".join(f"{key}={value}" for key, value in fields.items())
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC) as speaker:
            try:
                speaker.sendto(text.encode(), socket.MSG_DONTWAIT, self._address)
            except OSError:
                return

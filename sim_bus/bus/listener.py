"""Listening socket of a simulated bus, for the user who runs it and root."""

from __future__ import annotations

import os
import socket
import struct
import sys

from cdpr_sim_bus.bus.client import listening_socket

_CREDENTIALS = struct.Struct("3i")  # struct ucred: pid, uid, gid


class Listener:
    """Listens under the bus' `name`; raises BusSetupError where it is malformed or in use.

    An abstract socket has no permissions, so that every user of the machine can connect: let in
    are the user who runs the bus, and root.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._sock = listening_socket(name)
        self._allowed = frozenset({os.geteuid(), 0})
        self._has_told = False

    def fileno(self) -> int:
        """Return the descriptor that is readable when a client arrives."""
        return self._sock.fileno()

    def close(self) -> None:
        """Close the listening socket."""
        self._sock.close()

    def accept(self) -> socket.socket | None:
        """Return the connection of a client, None where its user may not connect or it has left."""
        try:
            sock, _ = self._sock.accept()
        except OSError:
            return None
        data = sock.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
        uid = _CREDENTIALS.unpack(data)[1]
        if uid in self._allowed:
            return sock
        sock.close()
        if not self._has_told:
            self._has_told = True
            print(
                f"simbus:{self._name}: user {uid} may not join; allowed: the user who runs the bus,"
                " and root (others after this one are not told)",
                file=sys.stderr,
                flush=True,
            )
        return None

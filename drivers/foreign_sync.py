"""Whether somebody else produces SYNC on a bus: heard before the first frame is sent there."""

from __future__ import annotations

from types import TracebackType
from typing import Self

from drivers.bus import BusUrl, open_port
from drivers.bus.packed import FRAME

_SYNC_ID = 0x080
_SOME = 2
"""One SYNC may be the last of a master that has just ended."""
_MOST = 10_000


class SyncEar:
    """Listens for SYNC from its making on; raises BusError."""

    def __init__(self, url: BusUrl) -> None:
        self._port = open_port(url, [(_SYNC_ID, 0x7FF)])
        self._port.settimeout(0.0)

    def heard(self) -> bool:
        """Return whether SYNC is produced; raises BusError."""
        buffer = bytearray(FRAME.size)
        syncs = 0
        for _ in range(_MOST):
            try:
                if not self._port.recv_into(buffer):
                    raise self._port.lost()
            except BlockingIOError:
                break
            except OSError as error:
                raise self._port.lost(error) from error
            syncs += FRAME.unpack(buffer)[0] == _SYNC_ID
            if syncs >= _SOME:
                return True
        return False

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._port.close()

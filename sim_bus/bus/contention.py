"""Arbitration between frames of several clients that wait together."""

from __future__ import annotations

from cdpr_sim_bus.bus.client import Client
from cdpr_sim_bus.frame import HEADER, LONGEST_FRAME_BITS, arbitration_key


class Contention:
    """The head of each client's queue; the clients' own order is kept.

    In lockstep the smallest identifier wins. In paced mode frames have times: one that was sent
    while the wire could still have been busy with an earlier one contends with it, a later one
    waits, however long the simulator itself was held up and whatever has come together meanwhile.
    """

    def __init__(self, *, paced: bool, bitrate: int) -> None:
        self._paced = paced
        self._window_s = LONGEST_FRAME_BITS / bitrate
        self._heads: dict[Client, tuple[int, bytes]] = {}

    def __bool__(self) -> bool:
        """Return whether a frame waits."""
        return bool(self._heads)

    def __contains__(self, client: Client) -> bool:
        """Return whether a frame of `client` waits."""
        return client in self._heads

    def add(self, client: Client, frame: bytes) -> None:
        """Queue the frame that `client` sent last."""
        self._heads[client] = (arbitration_key(HEADER.unpack_from(frame)[0]), frame)

    def discard(self, client: Client) -> None:
        """Discard the frame of a client that has disconnected."""
        self._heads.pop(client, None)

    def pop(self) -> tuple[Client, bytes]:
        """Return the frame that wins arbitration, with its sender; there must be one."""
        heads = self._heads
        if len(heads) == 1:
            client, (_, frame) = heads.popitem()
            return client, frame
        contending = list(heads)
        if self._paced:
            end_s = min(client.sent_s for client in contending) + self._window_s
            contending = [client for client in contending if client.sent_s <= end_s]
        winner = min(contending, key=lambda client: heads[client][0])
        return winner, heads.pop(winner)[1]

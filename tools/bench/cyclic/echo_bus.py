"""The far end of `cdpr bench bus`: a node that answers each of eight frames with another.

A program of its own, `python -m cdpr_tools.bench.cyclic.echo_bus BUS`, which ends with its
standard input. On a simulated bus it can be reached through a serial adapter and socketcand too.
"""

from __future__ import annotations

import math
import sys

from cdpr_sim_bus.bus.server import serve
from cdpr_sim_bus.clock import ClockMode
from cdpr_sim_bus.errors import SimulatorError
from cdpr_sim_bus.frame import HEADER, pack_frame

ASKED, ANSWERED = 0x200, 0x180
"""The frames asked with and answered by, plus a number from 1 on."""
FRAMES = 8


class EchoNode:
    """Answers 201h to 208h with 181h to 188h, 8 bytes each."""

    node_id = 1
    sync_period_s = 0.0

    def __init__(self) -> None:
        self.outbox: list[bytes] = []
        self.accepts = frozenset(range(ASKED + 1, ASKED + FRAMES + 1))
        self._answers = {k: pack_frame(k - ASKED + ANSWERED, bytes(range(8))) for k in self.accepts}

    def receive(self, frame: bytes, now: float) -> None:  # noqa: ARG002  # as LocalNode has it
        """Answer."""
        self.outbox.append(self._answers[HEADER.unpack_from(frame)[0]])

    def advance(self, now: float) -> None:
        """Do nothing: nothing here takes time."""

    def next_event(self) -> float:
        """Return that there will be none."""
        return math.inf

    def close(self) -> None:
        """Do nothing: nothing is held open."""


def main() -> None:
    """Serve the bus given as argument, with every gateway that it can have."""
    bus = sys.argv[1]
    simulated = bus.startswith("simbus:")
    try:
        serve(
            [EchoNode()],
            bus,
            mode=ClockMode.LOCKSTEP,
            until_stdin_ends=True,
            slcan=simulated,
            socketcand_port=0 if simulated else None,
        )
    except SimulatorError as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main()

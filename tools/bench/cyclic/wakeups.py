"""Run as a program: wait for deadlines as the control loop does, and tell how late it woke up.

Arguments: period in s, cycles, `ordinary` or `realtime`. Standard output gets one line of JSON
with what was not allowed, then the lateness of each cycle in ns as little-endian 64-bit numbers.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from typing import cast

import numpy as np
from numpy.typing import NDArray

from cdpr_rt.core.clock import PacedClock
from cdpr_rt.core.cycle import Cycle
from cdpr_rt.core.exchange import AxisDevice
from cdpr_rt.runtime.realtime import enable_realtime, freeze_memory

Times = NDArray[np.int64]
_WARM_UP = 100


class _NoDrives:
    """A device without axes and without a bus, so that only the waiting is left."""

    lockstep = False
    commands_s = 0.0

    def __init__(self, period_s: float) -> None:
        self.period_s = period_s
        self.clock = PacedClock()

    def sync(self) -> None:
        """Send nothing."""

    def receive(self) -> int:
        """Expect nothing."""
        return 0

    def transmit(self) -> None:
        """Send nothing."""


def measure(period_s: float, cycles: int) -> Times:
    """Return how late each of so many cycles began, (cycles,), in ns."""
    cycle = Cycle(cast(AxisDevice, _NoDrives(period_s)))
    late = np.zeros(cycles + _WARM_UP, np.int64)
    due_ns, period_ns = 0, round(period_s * 1e9)
    for k in range(late.size):
        cycle.exchange()
        began_ns = cycle.began_ns
        # one that is many cycles late gives up its deadlines; its lateness counts all the same
        deadline_ns = began_ns - round(cycle.late_s * 1e9)
        given_up = k > 0 and deadline_ns - due_ns > period_ns // 2
        late[k] = began_ns - (due_ns if given_up else deadline_ns)
        due_ns = deadline_ns + period_ns
        cycle.transmit()
    return late[_WARM_UP:]


def main(arguments: Sequence[str]) -> None:
    """Measure and write what was found."""
    period_s, cycles, how = float(arguments[0]), int(arguments[1]), arguments[2]
    notices = [*freeze_memory(), *enable_realtime()] if how == "realtime" else []
    late = measure(period_s, cycles)
    sys.stdout.buffer.write(json.dumps({"not_allowed": notices}).encode() + b"\n")
    sys.stdout.buffer.write(late.astype("<i8").tobytes())


if __name__ == "__main__":
    main(sys.argv[1:])

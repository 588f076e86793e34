"""One cycle of a device: its deadline, the exchange, alarms, the last command."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from cdpr_rt.core.exchange import AxisDevice
from cdpr_rt.core.fault import Fault

_LATE_SHARE = 0.1
_TOO_LATE_SHARE = 0.25


class Watch(Protocol):
    """Source other than the axes that may end their motion, such as safety I/O."""

    def fault(self) -> Fault | None:
        """Return the fault that must end the motion, or None; called in every cycle, so it must be
        fast.

        The limit of the fault is `SAFETY_ALARM` if the torque must be removed immediately, else
        `SAFETY_STOP`.
        """


@dataclass
class Lateness:
    """Statistics of the paced loop's deadlines."""

    cycles: int = 0
    late: int = 0
    """Cycles that started more than a tenth of a period after their deadline."""
    worst_s: float = 0.0


class Cycle:
    """Exchanges data with a device, and sends one command, in each cycle.

    On a lockstep device the next SYNC goes out as soon as `exchange` is called; otherwise each SYNC
    has an absolute deadline.
    """

    def __init__(self, device: AxisDevice, watches: Sequence[Watch] = ()) -> None:
        self.device = device
        self.watches = tuple(watches)
        self.lateness = Lateness()
        self.late_s = 0.0
        """Delay of this cycle's start after its deadline, 0 in lockstep."""
        self.began_ns = 0
        """CLOCK_MONOTONIC when this cycle's SYNC went out."""
        self.elapsed_s = device.period_s
        """Time from the last SYNC to this one; one period in lockstep and in the first cycle."""
        self._no_elapsed_yet = True
        self._deadline_s = 0.0
        self._no_deadline_yet = True
        self._free_s = 0.0
        """Latest time at which the last cycle's commands are off the wire."""

    def begin(self) -> None:
        """Begin after a pause of the cycles, so that the next cycle does not count as late."""
        self._no_deadline_yet = self._no_elapsed_yet = True

    def exchange(self) -> int:
        """Wait for the deadline, send SYNC, receive the answers; return how many axes answered."""
        if not self.device.lockstep:
            self._await_deadline()
        self._measure_elapsed()
        self.device.sync()
        return self.device.receive()

    def transmit(self, and_sync: bool = False) -> None:
        """Send the command, and close the cycle; see `AxisDevice.transmit`."""
        device = self.device
        device.transmit(and_sync)
        if not device.lockstep:
            self._free_s = device.clock.now_s + device.commands_s

    def watch_faults(self) -> list[Fault]:
        """Return the faults, from sources other than the axes, that must end the motion."""
        return [fault for watch in self.watches if (fault := watch.fault()) is not None]

    def _measure_elapsed(self) -> None:
        device, now_ns = self.device, time.monotonic_ns()
        steady = self._no_elapsed_yet or device.lockstep
        self.elapsed_s = device.period_s if steady else (now_ns - self.began_ns) * 1e-9
        self.began_ns, self._no_elapsed_yet = now_ns, False

    def _await_deadline(self) -> None:
        period, clock = self.device.period_s, self.device.clock
        self._deadline_s += period
        # A SYNC that meets commands on the wire is late, and delays all later ones. If this happens
        # in every cycle, as with a silent drive, the cycle rate must still be kept.
        too_late_s = _TOO_LATE_SHARE * period
        begin_s = min(max(self._deadline_s, self._free_s), self._deadline_s + too_late_s)
        now = clock.now_s
        if now < begin_s:
            clock.sleep_until(begin_s)
            now = clock.now_s
        elif self._no_deadline_yet:
            self._deadline_s = now
        self._no_deadline_yet = False
        self.late_s = now - self._deadline_s
        if now - begin_s > too_late_s:
            self._deadline_s = now  # new time base, so that the next cycles do not catch up
        lateness = self.lateness
        lateness.cycles += 1
        lateness.late += self.late_s > _LATE_SHARE * period
        lateness.worst_s = max(lateness.worst_s, self.late_s)

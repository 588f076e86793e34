"""What another process has used of the processors so far."""

from __future__ import annotations

import time

_SCHEDULED = 2  # CPUCLOCK_SCHED: as the scheduler counts, to the nanosecond


def processor_time_s(pid: int) -> float:
    """Return the processor time of all threads of a process, past ones included."""
    # a process' clock is named by its id (clock_getcpuclockid, of which Python has none)
    return time.clock_gettime_ns((~pid << 3) | _SCHEDULED) * 1e-9

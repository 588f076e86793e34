"""Time the frames would take on a real wire: load, and cycles whose traffic does not fit."""

from __future__ import annotations

from cdpr_sim_bus.frame import LONGEST_FRAME_BITS, base_id


def is_acyclic(can_id: int) -> bool:
    """Return whether the identifier is of acyclic traffic, which waits for gaps between the PDOs.

    SDO, heartbeat and LSS of the predefined connection set (CiA 301): they lose arbitration
    against SYNC and PDOs, so they never make a cycle too long by more than one frame.
    """
    base = base_id(can_id)
    return 0x580 <= base <= 0x67F or 0x700 <= base <= 0x77F or base in (0x7E4, 0x7E5)


class BusLoad:
    """Worst-case bits of all frames compared with bus time.

    In lockstep bus time stands still while a cycle's frames go, so their sum is compared with
    the bus time from SYNC to SYNC. In paced mode the wire is followed frame by frame: a cycle
    overruns when at its end the wire would still be busy for longer than one frame takes.
    """

    def __init__(self, bitrate: int, *, lockstep: bool) -> None:
        self.bitrate = bitrate
        self.frames = 0
        self.overruns = 0
        self.peak_cycle_load = 0.0
        self.cycle_bits = 0
        """Bits of cyclic traffic since the last SYNC; the hub adds to it frame by frame."""
        self.acyclic_bits = 0
        self._lockstep = lockstep
        self._bit_s = 1.0 / bitrate
        self._longest_s = LONGEST_FRAME_BITS * self._bit_s
        self._past_bits = 0
        self._last_sync_s = -1.0
        self._busy_until_s = 0.0

    def occupy(self, now_s: float, bits: int) -> None:
        """Put a cyclic frame of `bits` on the wire at `now_s` (paced mode only)."""
        self._busy_until_s = max(self._busy_until_s, now_s) + bits * self._bit_s

    def sync(self, now_s: float) -> None:
        """Close the cycle that ends with the SYNC at `now_s`."""
        window_s = now_s - self._last_sync_s
        if self._last_sync_s >= 0.0 and window_s > 0.0:
            load = self.cycle_bits * self._bit_s / window_s
            self.peak_cycle_load = max(self.peak_cycle_load, load)
            # a bit of slack for the rounding of bus time
            if load > 1.0 + 1e-9 if self._lockstep else self._backlog_s(now_s) > 0.0:
                self.overruns += 1
        self._past_bits += self.cycle_bits
        self.cycle_bits = 0
        self._last_sync_s = now_s

    def _backlog_s(self, now_s: float) -> float:
        return self._busy_until_s - now_s - self._longest_s

    def load(self, now_s: float) -> float:
        """Return the share of bus time since the start during which the wire was in use."""
        bits = self._past_bits + self.cycle_bits + self.acyclic_bits
        return bits * self._bit_s / now_s if now_s > 0.0 else 0.0

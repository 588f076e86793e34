"""Bus budget: whether the frames of a cycle fit into its period, with worst-case bit stuffing."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from cdpr_profiles import DriveProfile, Pdo, Robot, Winch

_SYNC_BYTES, _HEARTBEAT_BYTES, _FULL_BYTES = 0, 1, 8
_COMMAND_OBJECTS = (0x6040, 0x6071)
_AT_EVERY_SYNC = range(1, 241)
_ON_REQUEST = (252, 253)
# number of master heartbeats sent within the time that a drive tolerates without one
HEARTBEATS_IN_TOLERANCE = 4


def worst_case_bits(n: int) -> int:
    """Return the maximum number of bits of a frame with an 11-bit identifier and `n` data bytes.

    The 34 + 8n bits from start of frame to the CRC may be stuffed: once after five equal bits, then
    after every four, because a stuff bit counts as the first of the next five. 13 more bits,
    interframe space included, are never stuffed (ISO 11898-1).
    """
    return bare_bits(n) + (34 + 8 * n - 1) // 4


def bare_bits(n: int) -> int:
    """Return the number of bits of a frame with `n` data bytes, without stuff bits."""
    return 8 * n + 47


@dataclass(frozen=True)
class BusBudget:
    """Load of one bus of a machine, in seconds on the wire."""

    bus: str
    bitrate_bit_s: int
    nodes: tuple[int, ...]
    period_s: float
    cycle_s: float
    """SYNC and every PDO of a cycle, with worst-case bit stuffing."""
    bare_cycle_s: float
    """The same without stuff bits."""
    commands_s: float
    """Part of the cycle that the master sends, without SYNC."""
    heartbeat_share: float
    """Share of the wire used by heartbeats and by PDOs with an inhibit time or event timer."""
    changes_s: float
    """Time of the PDOs that drives send on a change, if all send together; they wait for gaps."""
    longest_wait_s: float
    """Longest time that SYNC may wait for the end of another frame."""

    @property
    def margin_s(self) -> float:
        """Time in a cycle that remains for SDO, EMCY, PDOs sent on a change, and computing."""
        return self.period_s * (1.0 - self.heartbeat_share) - self.cycle_s

    @property
    def fits(self) -> bool:
        """Whether the cycles can continue indefinitely, heartbeats included."""
        return self.margin_s >= -1e-12

    @property
    def cycle_limit_Hz(self) -> float:
        """Rate at which cycles alone fill the bus."""
        return 1.0 / self.cycle_s

    @property
    def highest_rate_Hz(self) -> float:
        """Highest rate that leaves room for the heartbeats."""
        return max(0.0, 1.0 - self.heartbeat_share) / self.cycle_s

    @property
    def sdo_transfers_s(self) -> float:
        """Expedited SDO transfers (request and answer) per second that fit between the cycles."""
        transfer_s = 2 * worst_case_bits(_FULL_BYTES) / self.bitrate_bit_s
        return max(0.0, self.margin_s) / self.period_s / transfer_s

    @property
    def recovery_cycles(self) -> float:
        """Cycles until all drives have sent their PDOs on a change; inf if there is no margin."""
        if self.changes_s == 0.0:
            return 0.0
        return math.inf if self.margin_s <= 0.0 else math.ceil(self.changes_s / self.margin_s)

    def __str__(self) -> str:
        """Return the figures in one sentence, for messages."""
        rate_Hz = self.highest_rate_Hz
        period = f" (sync_period_s {math.ceil(1e6 / rate_Hz) * 1e-6:g})" if rate_Hz > 0.0 else ""
        return (
            f"bus {self.bus}: {len(self.nodes)} drives need {self.cycle_s * 1e6:.0f} us of each "
            f"cycle in the worst case and {self.heartbeat_share * self.period_s * 1e6:.1f} "
            f"us for heartbeats, but a cycle at {1.0 / self.period_s:.6g} Hz has "
            f"{self.period_s * 1e6:.0f} us"
            f"; highest rate at {self.bitrate_bit_s} bit/s: {math.floor(rate_Hz)} Hz{period}"
        )


def bus_budget(
    bus: str,
    bitrate_bit_s: int,
    period_s: float,
    drives: Sequence[tuple[int, DriveProfile]],
    master_heartbeat_s: float | None = None,
) -> BusBudget:
    """Return the budget of a bus with `drives`, each a node id and its profile.

    By default, `master_heartbeat_s` follows from the times that the drives tolerate.
    """
    # bytes of each frame
    every = [_SYNC_BYTES]
    commands = [_bytes(pdo) for _, drive in drives for pdo in command_pdos(drive)]
    waiting: list[int] = []
    share_bit_s = 0.0
    last = max(
        (pdo.cob_id(node) for node, drive in drives for pdo in _cyclic_pdos(drive)), default=0
    )
    for node, drive in drives:
        every += [_bytes(pdo) for pdo in _cyclic_pdos(drive)]
        for pdo in _pdos_on_change(drive):
            if pdo.cob_id(node) < last:
                # it wins arbitration against a PDO of the cycle, so every cycle may contain it
                every.append(_bytes(pdo))
                continue
            waiting.append(_bytes(pdo))
            pause_s = pdo.inhibit_time_s or pdo.event_timer_s
            share_bit_s += worst_case_bits(_bytes(pdo)) / pause_s if pause_s else 0.0
        share_bit_s += worst_case_bits(_HEARTBEAT_BYTES) / drive.heartbeat_producer_s
    if drives:
        tolerated_s = min(drive.heartbeat_consumer_s for _, drive in drives)
        every_s = master_heartbeat_s or tolerated_s / HEARTBEATS_IN_TOLERANCE
        share_bit_s += worst_case_bits(_HEARTBEAT_BYTES) / every_s
    return BusBudget(
        bus=bus,
        bitrate_bit_s=bitrate_bit_s,
        nodes=tuple(node for node, _ in drives),
        period_s=period_s,
        cycle_s=_worst_bits(every) / bitrate_bit_s,
        bare_cycle_s=sum(map(bare_bits, every)) / bitrate_bit_s,
        commands_s=_worst_bits(commands) / bitrate_bit_s,
        heartbeat_share=share_bit_s / bitrate_bit_s,
        changes_s=_worst_bits(waiting) / bitrate_bit_s,
        longest_wait_s=worst_case_bits(_FULL_BYTES) / bitrate_bit_s,
    )


def machine_budget(machine: Winch | Robot, period_s: float | None = None) -> list[BusBudget]:
    """Return the budget of each bus of a winch or a robot, at its own cycle or `period_s`."""
    period_s = period_s or machine.sync_period_s
    if isinstance(machine, Winch):
        drives = [(machine.node_id, machine.drive)]
        return [bus_budget("of the winch", machine.bitrate_bit_s, period_s, drives)]
    return [
        bus_budget(
            bus.name,
            bus.bitrate_bit_s,
            period_s,
            [(axis.node_id, axis.winch.drive) for axis in machine.axes if axis.bus == bus.name],
            machine.master_heartbeat_s,
        )
        for bus in machine.buses
    ]


def _worst_bits(lengths: Iterable[int]) -> int:
    return sum(worst_case_bits(n) for n in lengths)


def command_pdos(drive: DriveProfile) -> list[Pdo]:
    """Return the PDOs that the master sends to a drive in every cycle."""
    return [p for p in drive.rpdos if any(e.index in _COMMAND_OBJECTS for e in p.entries)]


def answer_pdos(drive: DriveProfile) -> list[Pdo]:
    """Return the PDOs with which a drive answers every SYNC or every n-th SYNC."""
    return [p for p in drive.tpdos if p.transmission_type in _AT_EVERY_SYNC]


def _cyclic_pdos(drive: DriveProfile) -> list[Pdo]:
    return command_pdos(drive) + answer_pdos(drive)


def _pdos_on_change(drive: DriveProfile) -> list[Pdo]:
    return [
        p
        for p in drive.tpdos
        if p.transmission_type not in _AT_EVERY_SYNC and p.transmission_type not in _ON_REQUEST
    ]


def _bytes(pdo: Pdo) -> int:
    return sum(entry.bits for entry in pdo.entries) // 8

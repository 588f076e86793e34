"""What passed over a bus in all: frames and rates by identifier, load, trouble."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from cdpr_drivers.bus.budget import worst_case_bits
from cdpr_drivers.decode import Frame, Record

_MORE_BITS_EXTENDED = 25
"""20 bits of the identifier and the 5 that they may have stuffed."""


@dataclass
class _Traffic:
    node_id: int | None
    kind: str
    frames: int = 0


@dataclass
class Summary:
    """Counts what it is given; `bitrate_bit_s` is what the load is relative to."""

    bitrate_bit_s: int
    frames: int = 0
    problems: int = 0
    bits: int = 0
    first_s: float | None = None
    last_s: float = 0.0
    time_s: float | None = None
    """What the traffic took, where something else than its time stamps tells."""
    untimed: bool = False
    """Whether the time stamps are not those of the traffic and nothing else tells its time."""
    missed: int | None = None
    """Frames that went past the monitor, where that is known."""
    led: bool | None = None
    """Whether a master leads the bus at the end, where that is known."""
    _by_id: dict[tuple[str, str], _Traffic] = field(default_factory=dict)

    def add(self, record: Record) -> None:
        """Count one frame."""
        frame = record.frame
        if self.first_s is None:
            self.first_s = frame.time_s
        self.last_s = frame.time_s
        self.frames += 1
        self.problems += record.problem
        self.bits += _bits(frame)
        key = (frame.id_text, record.kind)
        traffic = self._by_id.get(key)
        if traffic is None:
            traffic = self._by_id[key] = _Traffic(record.node_id, record.kind)
        traffic.frames += 1

    @property
    def duration_s(self) -> float:
        """Return what the traffic took: as reported, or from the first frame to the last."""
        if self.time_s is not None:
            return self.time_s
        return 0.0 if self.first_s is None else self.last_s - self.first_s

    @property
    def load(self) -> float | None:
        """Return the share of time that the wire was in use at most; None for a moment only."""
        return self.bits / self.bitrate_bit_s / self.duration_s if self._has_rates else None

    @property
    def _has_rates(self) -> bool:
        return self.duration_s > 0 and not self.untimed

    def rows(self) -> list[dict[str, Any]]:
        """Return frames and frames a second by identifier, in the order of their priority."""
        rows = []
        for (identifier, kind), traffic in sorted(self._by_id.items()):
            rate = traffic.frames / self.duration_s if self._has_rates else None
            rows.append(
                {
                    "id": identifier,
                    "kind": kind,
                    "node_id": traffic.node_id,
                    "frames": traffic.frames,
                    "per_s": rate,
                }
            )
        return rows

    def table(self) -> dict[str, Any]:
        """Return the summary for programs."""
        return {
            "frames": self.frames,
            "duration_s": self.duration_s,
            "load": self.load,
            "bitrate_bit_s": self.bitrate_bit_s,
            "problems": self.problems,
            "missed": self.missed,
            "led": self.led,
            "ids": self.rows(),
        }

    def lines(self) -> list[str]:
        """Return the summary for people."""
        whose = " of bus time" if self.time_s is not None else ""
        what = "1 frame" if self.frames == 1 else f"{self.frames} frames"
        totals = [f"{what} in {self.duration_s:.3f} s{whose}"]
        if self.load is not None:
            rate = f"{self.bitrate_bit_s / 1e3:g} kbit/s"
            totals.append(f"bus load {100 * self.load:.1f} % of {rate}, stuffed as badly as can be")
        totals.append(f"{self.problems} told of trouble (marked !)")
        lines = ["; ".join(totals)]
        if self.missed:
            lines.append(
                f"{self.missed} frames went by unseen: the bus was faster than the monitor"
            )
        if self.led:
            lines.append("a master leads this bus: its time moves by that master's packets alone")
        if self._by_id:
            lines.append(f"{'id':>8} {'node':>5}  {'what':<10}{'frames':>9}{'per s':>10}")
        for row in self.rows():
            node = "" if row["node_id"] is None else row["node_id"]
            rate = "" if row["per_s"] is None else f"{row['per_s']:.1f}"
            line = f"{row['id']:>8} {node:>5}  {row['kind']:<10}{row['frames']:>9}{rate:>10}"
            lines.append(line.rstrip())
        return lines


def _bits(frame: Frame) -> int:
    if frame.error:
        return 0
    return worst_case_bits(len(frame.data)) + (_MORE_BITS_EXTENDED if frame.extended else 0)

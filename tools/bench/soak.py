"""Hours of bus time with a whole robot in lockstep: nothing may leak and no frame be lost."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drivers.bus.budget import answer_pdos, command_pdos
from cdpr_drivers.errors import DriverError
from cdpr_drivers.robot.session import Session
from cdpr_profiles import Robot
from cdpr_rt.control.proportional import Proportional
from cdpr_rt.errors import ControlError
from cdpr_rt.motion.trajectory import TrapezoidalMove
from cdpr_tools.composition.session import open_robot
from cdpr_tools.errors import WorkFailedError
from cdpr_tools.output import Output

MEMORY_LIMIT_KiB = 2048
"""What each process may gain after it has warmed up: the allocator's own coming and going."""
_HOUR_S = 3600.0
_LEG_S, _RAMP_S = 60.0, 0.5
_WARM_UP_CYCLES = 12_000  # until every row of the recorder's ring has been written once
_SPEED_RAD_S = 1.0
_TORQUE_SHARE = 0.5
# of the loop's own frequency over the delay of one and a half cycles, in rad
_PHASE = 0.25


@dataclass(frozen=True)
class Process:
    """What one process holds at one moment."""

    memory_KiB: int
    """Of its own, swapped out or not: what a file backs, the kernel takes and gives as it likes."""
    open_files: int

    @classmethod
    def of(cls, pid: int) -> Process:
        """Look at a process of this machine."""
        lines = Path(f"/proc/{pid}/status").read_text().splitlines()
        status = dict(line.split(":", 1) for line in lines)
        memory = sum(int(status[key].split()[0]) for key in ("RssAnon", "RssShmem", "VmSwap"))
        return cls(memory, sum(1 for _ in Path(f"/proc/{pid}/fd").iterdir()))


@dataclass(frozen=True)
class Counts:
    """Frames as one bus counts them, and as they follow from what the master has done."""

    cycles: int
    transmits: int
    missed: int
    bus_time_s: float
    bus: Mapping[str, Any]

    @classmethod
    def of(cls, session: Session, name: str, status: Mapping[str, Any]) -> Counts:
        """Take the counts of the robot's bus `name`."""
        device = session.device
        group = device.groups[[bus.name for bus in device.buses].index(name)]
        return cls(
            group.feedback.cycle, device.transmits, group.missed, status["bus_time_s"], status
        )

    @classmethod
    def all(cls, session: Session) -> dict[str, Counts]:
        """Take the counts of every bus, by the robot's name of it."""
        status = session.bus_status()
        return {name: cls.of(session, name, one) for name, one in status.items()}


@dataclass(frozen=True)
class BusVerdict:
    """How a bus fared between two counts."""

    bus: str
    syncs_lost: int
    answers_missed: int
    dropped: int
    malformed: int
    frames_expected: int
    frames_counted: int
    overruns: int
    """Cycles whose frames did not fit into the bus time between two SYNCs."""
    tolerance: int
    """Heartbeats that may fall just inside or outside of the interval."""

    @property
    def lost(self) -> int:
        """Frames that one side has sent and the other has not seen."""
        gap = max(0, self.frames_expected - self.frames_counted - self.tolerance)
        return abs(self.syncs_lost) + self.answers_missed + self.dropped + self.malformed + gap


def compare(name: str, session: Session, before: Counts, after: Counts) -> BusVerdict:
    """Hold what the master has done on a bus against what the bus has counted."""
    device = session.device
    bus = next(bus for bus in device.buses if bus.name == name)
    cycles, transmits = after.cycles - before.cycles, after.transmits - before.transmits
    missed = after.missed - before.missed
    elapsed_s = after.bus_time_s - before.bus_time_s
    frames = cycles - missed + cycles / max(1, round(bus.network.heartbeat_s / device.period_s))
    for drive in (axis.drive for axis in bus.axes):
        frames += transmits * len(command_pdos(drive))
        frames += sum(cycles / pdo.transmission_type for pdo in answer_pdos(drive))
        frames += elapsed_s / drive.heartbeat_producer_s
    return BusVerdict(
        bus=name,
        syncs_lost=cycles - (after.bus["sync_count"] - before.bus["sync_count"]),
        answers_missed=missed,
        dropped=after.bus["dropped"] - before.bus["dropped"],
        malformed=after.bus["malformed"] - before.bus["malformed"],
        frames_expected=round(frames),
        frames_counted=after.bus["frames"] - before.bus["frames"],
        overruns=after.bus["overruns"] - before.bus["overruns"],
        tolerance=2 * (len(bus.axes) + 1),
    )


def growth(samples: Sequence[Process]) -> Process:
    """Return what a process has gained: the least of its later half over that of its first."""
    middle = len(samples) // 2
    first, later = samples[:middle], samples[middle:]
    return Process(
        min(s.memory_KiB for s in later) - min(s.memory_KiB for s in first),
        min(s.open_files for s in later) - min(s.open_files for s in first),
    )


class Soak:
    """Runs an enabled robot to and fro for hours, and looks at both processes as it goes."""

    def __init__(self, session: Session) -> None:
        self.session = session
        pids = {"master": os.getpid()}
        if session.simulator_pid is not None:
            pids["simulator"] = session.simulator_pid
        self._pids = pids
        self.samples: dict[str, list[Process]] = {name: [] for name in pids}
        device = session.device
        motors = [axis.winch.motor for axis in session.robot.axes]
        frequency = _PHASE / (1.5 * device.period_s)
        gain = frequency**2 * np.array([motor.rotor_inertia_kg_m2 for motor in motors])
        limit = _TORQUE_SHARE * np.array([motor.rated_torque_Nm for motor in motors])
        self._controller = Proportional(gain, limit)
        self._speed = _SPEED_RAD_S * np.where(np.arange(device.n) % 2, -1.0, 1.0)
        self.bus_s = self.wall_s = 0.0
        self._before = Counts.all(session)

    def run(
        self, seconds: float, advance: Callable[[float], None], most_wall_s: float = math.inf
    ) -> None:
        """Move for `seconds` of bus time, or until the leg in which `most_wall_s` have passed.

        Raises WorkFailedError when the motion ends early.
        """
        self._before = Counts.all(self.session)
        self._sample()
        begin, cycle = time.monotonic(), self.session.device.feedback.cycle
        period_s = self.session.device.period_s
        try:
            while self.bus_s < seconds - period_s and self.wall_s < most_wall_s:
                self._leg(min(_LEG_S, seconds - self.bus_s))
                self.bus_s = (self.session.device.feedback.cycle - cycle) * period_s
                self.wall_s = time.monotonic() - begin
                advance(self.bus_s)
                self._sample()
        except (ControlError, DriverError) as error:
            hours = (self.session.device.feedback.cycle - cycle) * period_s / _HOUR_S
            raise WorkFailedError(f"after {hours:.4f} h of bus time: {error}") from error

    def _leg(self, seconds: float) -> None:
        start = self.session.device.feedback.position_rad.copy()
        cruise_s = max(0.0, seconds - 2.0 * _RAMP_S)
        self.session.follow(
            self._controller, TrapezoidalMove(start, self._speed, cruise_s, _RAMP_S)
        )
        self._speed = -self._speed

    def _sample(self) -> None:
        for name, pid in self._pids.items():
            self.samples[name].append(Process.of(pid))

    def figures(self) -> dict[str, Any]:
        """Return what was measured, and whether all is well."""
        after = Counts.all(self.session)
        buses = [
            compare(name, self.session, before, after[name])
            for name, before in self._before.items()
        ]
        grown = {name: growth(samples) for name, samples in self.samples.items()}
        cycles = round(self.bus_s / self.session.device.period_s)
        lost = sum(verdict.lost for verdict in buses)
        leaks = [
            name
            for name, gain in grown.items()
            if gain.memory_KiB > MEMORY_LIMIT_KiB or gain.open_files > 0
        ]
        return {
            "bus_hours": self.bus_s / _HOUR_S,
            "wall_s": round(self.wall_s, 1),
            "cycles": cycles,
            "us_per_cycle": round(1e6 * self.wall_s / max(1, cycles), 1),
            "bus_hours_in_10_minutes": round(self.bus_s / max(self.wall_s, 1e-9) / 6.0, 2),
            "wall_hours_for_24_bus_hours": round(24.0 * self.wall_s / max(self.bus_s, 1e-9), 2),
            "memory_growth_KiB": {name: gain.memory_KiB for name, gain in grown.items()},
            "open_files_growth": {name: gain.open_files for name, gain in grown.items()},
            "memory_KiB": {name: s[-1].memory_KiB for name, s in self.samples.items()},
            "buses": {verdict.bus: asdict(verdict) | {"lost": verdict.lost} for verdict in buses},
            "missed_answers": sum(verdict.answers_missed for verdict in buses),
            "lost_frames": lost,
            "leaks": leaks,
            "ok": not lost and not leaks,
        }


def measure(
    robot: Robot, hours: float, most_wall_s: float, rate_Hz: float | None, out: Output
) -> dict[str, Any]:
    """Run `robot` on a simulator of its own for `hours` of bus time; return the figures.

    It ends earlier when `most_wall_s` have passed.

    `rate_Hz` is another rate of cycles than the robot's: a lower one lets more bus time pass for
    the same frames. Raises WorkFailedError when the motion ends early.
    """
    if rate_Hz is not None:
        robot = replace(robot, sync_period_s=1.0 / rate_Hz)
    seconds = hours * _HOUR_S
    with open_robot(robot, ["simbus:"], out) as session:
        session.enable()
        Soak(session).run(_WARM_UP_CYCLES * robot.sync_period_s, lambda _: None)
        soak = Soak(session)
        with out.progress(f"{hours:g} h of bus time", seconds) as advance:
            soak.run(seconds, advance, most_wall_s)
        figures = soak.figures()
        session.disable()
    head = {
        "robot": robot.reference,
        "rate_Hz": 1.0 / robot.sync_period_s,
        "drives": len(robot.axes),
        "boot_s": round(session.boot_s, 3),
    }
    return head | figures | ({} if figures["ok"] else {"error": _failure(figures)})


def _failure(figures: dict[str, Any]) -> str:
    texts = [f"{figures['lost_frames']} frames were lost"] if figures["lost_frames"] else []
    texts += [
        f"the {name} gained {figures['memory_growth_KiB'][name]} KiB and "
        f"{figures['open_files_growth'][name]} open files"
        for name in figures["leaks"]
    ]
    return "; ".join(texts)


def report(figures: dict[str, Any]) -> list[str]:
    """Return the figures as lines, one for each bus and process."""
    lines = [
        f"{figures['drives']} drives were up in {figures['boot_s']:.2f} s of bus time",
        f"{figures['robot']} at {figures['rate_Hz']:g} Hz: {figures['bus_hours']:.3f} h of bus "
        f"time, {figures['cycles']} cycles, in {figures['wall_s']:.0f} s "
        f"({figures['us_per_cycle']:.0f} us each)",
        f"{figures['bus_hours_in_10_minutes']:.2f} h fit into 10 minutes; 24 h take "
        f"{figures['wall_hours_for_24_bus_hours']:.1f} h",
    ]
    for name, verdict in figures["buses"].items():
        lines.append(
            f"bus {name}: {verdict['frames_counted']} frames on the bus, "
            f"{verdict['frames_expected']} expected by the master (heartbeats to within "
            f"{verdict['tolerance']}); SYNCs lost {verdict['syncs_lost']}, answers missed "
            f"{verdict['answers_missed']}, dropped {verdict['dropped']}, cycles that did not fit "
            f"{verdict['overruns']}"
        )
    for name, gained in figures["memory_growth_KiB"].items():
        lines.append(
            f"{name}: {figures['memory_KiB'][name] / 1024:.0f} MiB, grown by {gained} KiB; "
            f"open files grown by {figures['open_files_growth'][name]}"
        )
    return lines
